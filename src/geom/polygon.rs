use glam::DVec3;

/// The plane of a polygon by Newell's method: (unit normal, point); or why the
/// points are not a planar polygon.
pub fn polygon_plane(points: &[DVec3]) -> Result<(DVec3, DVec3), String> {
    let origin = points[0];
    let size = points
        .iter()
        .map(|p| (*p - origin).abs().max_element())
        .fold(0.0, f64::max);
    if size == 0.0 {
        return Err("all its points are one point".into());
    }
    // About the first point and scaled to unit size, so that nothing cancels
    // or overflows.
    let at = |i: usize| (points[i % points.len()] - origin) / size;
    let normal: DVec3 = (0..points.len()).map(|i| at(i).cross(at(i + 1))).sum();
    let length = normal.length();
    if length < 1e-12 {
        return Err("its points lie on a line".into());
    }
    let normal = normal / length;
    let off = (0..points.len())
        .map(|i| at(i).dot(normal).abs())
        .fold(0.0, f64::max);
    if off > 1e-3 {
        return Err(format!(
            "its points are not in one plane (off by {off:.1e} of its size); split it into triangles"
        ));
    }
    Ok((normal, origin))
}
