//! Groups of boxes that planes across the axes part from each other.

use crate::math::Aabb;

/// How often groups are parted; few files need more than once for each axis.
const ROUNDS: usize = 12;

/// Parts boxes, by their rows, into groups: of two groups no boxes come closer to each other than
/// the margin. Rows rise in every group, and groups by their first row.
pub(super) fn clusters(boxes: &[Aabb], margin: f64) -> Vec<Vec<u32>> {
    let mut groups: Vec<Vec<u32>> = vec![(0..boxes.len() as u32).collect()];
    // How many rounds in turn have parted nothing.
    let mut idle = 0;
    for round in 0..ROUNDS {
        if idle == 3 {
            break;
        }
        let before = groups.len();
        let parted = groups.into_iter();
        groups = parted
            .flat_map(|group| part(boxes, group, margin, round % 3))
            .collect();
        idle = if groups.len() == before { idle + 1 } else { 0 };
    }
    groups.retain(|group| !group.is_empty());
    for group in &mut groups {
        group.sort_unstable();
    }
    groups.sort_unstable_by_key(|group| group[0]);
    groups
}

/// Parts a group where no box is, along an axis.
fn part(boxes: &[Aabb], mut group: Vec<u32>, margin: f64, axis: usize) -> Vec<Vec<u32>> {
    let low = |row: &u32| boxes[*row as usize].min[axis];
    group.sort_by(|a, b| low(a).total_cmp(&low(b)));
    let mut parts: Vec<Vec<u32>> = Vec::new();
    let mut end = f64::NEG_INFINITY;
    for row in group {
        match parts.last_mut() {
            Some(last) if !(low(&row) > end + margin) => last.push(row),
            _ => parts.push(vec![row]),
        }
        end = end.max(boxes[row as usize].max[axis]);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn boxes_that_touch_stay_together() {
        let cube =
            |x: f64, y: f64| Aabb::new(DVec3::new(x, y, 0.0), DVec3::new(x + 1.0, y + 1.0, 1.0));
        let boxes = [
            cube(0.0, 0.0),
            cube(5.0, 0.0),
            cube(1.0, 0.0),
            cube(0.0, 5.0),
            cube(5.5, 0.5),
        ];
        assert_eq!(clusters(&boxes, 0.01), [vec![0, 2], vec![1, 4], vec![3]]);
        assert_eq!(clusters(&[], 0.01), Vec::<Vec<u32>>::new());
    }
}
