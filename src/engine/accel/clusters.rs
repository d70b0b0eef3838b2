//! Clusters of boxes: groups that lie so far apart that one box around them all is nearly
//! empty.
//!
//! Whoever sees a shared node from above sees boxes around all that it holds. One child far
//! away makes such a box long, and rays enter it in vain at each of the node's copies. So a
//! node gets a tree for each cluster of its children, and each has its own box above.

use crate::math::Aabb;

/// The most clusters of one set. Each costs its owners a box.
const MAX_CLUSTERS: usize = 4;

/// How many times smaller the areas of two clusters together are than that of the box around
/// both. A ray meets boxes in proportion to their areas.
const GAIN: f64 = 64.0;

/// Returns the rows of `boxes`, which are not empty, by cluster; each in ascending order.
pub(super) fn clusters(boxes: &[Aabb]) -> Vec<Vec<usize>> {
    let mut whole: Vec<Vec<usize>> = Vec::new();
    let mut open = vec![(0..boxes.len()).collect::<Vec<usize>>()];
    while let Some(rows) = open.pop() {
        if whole.len() + open.len() + 2 > MAX_CLUSTERS {
            whole.push(rows);
            continue;
        }
        match parted(boxes, &rows) {
            Some(parts) => open.extend(parts),
            None => whole.push(rows),
        }
    }
    whole.sort();
    whole
}

/// Parts rows in two along one axis, where that saves the area that [`GAIN`] asks for.
fn parted(boxes: &[Aabb], rows: &[usize]) -> Option<[Vec<usize>; 2]> {
    let around = |rows: &[usize]| {
        let each = rows.iter().map(|row| boxes[*row]);
        each.fold(Aabb::EMPTY, |all, b| all.union(&b))
    };
    let all = around(rows);
    let unit = all.extent().max_element();
    // Relative to the extent, so that no area leaves f64's range.
    let area = |b: &Aabb| {
        let e = b.extent() / unit;
        e.x * e.y + e.y * e.z + e.z * e.x
    };
    let (mut least, mut best) = (area(&all) / GAIN, None);
    let orders = [0, 1, 2].map(|axis| {
        let mut order = rows.to_vec();
        let middle = |row: &usize| boxes[*row].center()[axis];
        order.sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        order
    });
    for (axis, order) in orders.iter().enumerate() {
        // Areas of the boxes around the last rows, from each place on.
        let mut behind = Aabb::EMPTY;
        let mut areas_behind: Vec<f64> = order
            .iter()
            .rev()
            .map(|row| {
                behind = behind.union(&boxes[*row]);
                area(&behind)
            })
            .collect();
        areas_behind.reverse();
        let mut before = Aabb::EMPTY;
        for place in 1..order.len() {
            before = before.union(&boxes[order[place - 1]]);
            let both = area(&before) + areas_behind[place];
            if both < least {
                (least, best) = (both, Some((axis, place)));
            }
        }
    }
    let (axis, place) = best?;
    let (before, behind) = orders[axis].split_at(place);
    let mut parts = [before.to_vec(), behind.to_vec()];
    parts.iter_mut().for_each(|part| part.sort_unstable());
    Some(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn cube(x: f64, half: f64) -> Aabb {
        Aabb::of_points([DVec3::new(x, 0.0, 0.0)]).grown(DVec3::splat(half))
    }

    #[test]
    fn what_lies_close_stays_together() {
        let row: Vec<Aabb> = (0..100).map(|x| cube(f64::from(x), 0.3)).collect();
        assert_eq!(clusters(&row), [(0..100).collect::<Vec<_>>()]);
        assert_eq!(clusters(&row[..1]), [[0]]);
    }

    #[test]
    fn what_lies_far_off_stands_alone() {
        for far in [1e4, 1e8, 1e100, 1e300] {
            let mut boxes: Vec<Aabb> = (0..9).map(|x| cube(f64::from(x), 0.6)).collect();
            boxes.insert(5, cube(far, far * 1e-15 + 0.6));
            assert_eq!(clusters(&boxes), [vec![0, 1, 2, 3, 4, 6, 7, 8, 9], vec![5]]);
        }
    }

    #[test]
    fn there_are_few() {
        let boxes: Vec<Aabb> = (0..9)
            .map(|k| cube(libm::exp10(3.0 * f64::from(k)), 0.5))
            .collect();
        let found = clusters(&boxes);
        assert_eq!(found.len(), MAX_CLUSTERS);
        let mut all = found.concat();
        all.sort_unstable();
        assert_eq!(all, (0..9).collect::<Vec<_>>());
    }
}
