//! Fig. 8: the radar chart of original and current distances, read back from its drawing.

use haptic_server::report::radar::{RadarAxis, radar_svg};

/// Points of every polygon whose stroke has this colour and is solid.
fn outlines(svg: &str, colour: &str) -> Vec<Vec<(f64, f64)>> {
    let stroke = format!("stroke=\"{colour}\"");
    let solid = |tag: &&str| tag.starts_with("polygon") && tag.contains(&stroke) && !tag.contains("dasharray");
    let points = |tag: &str| {
        let list = tag.split("points=\"").nth(1).and_then(|t| t.split('"').next()).unwrap_or_default();
        let pair = |p: &str| p.split_once(',').map(|(x, y)| (x.parse().expect("x"), y.parse().expect("y")));
        list.split_whitespace().filter_map(pair).collect()
    };
    svg.split('<').filter(solid).map(points).collect()
}

#[test]
fn fig8_radar_shows_both_distances_of_twelve_stitches_to_scale() {
    let axes: Vec<RadarAxis> = (0..12)
        .map(|i| {
            let original_mm = 1.0 + 0.2 * f64::from(i);
            RadarAxis {
                label: format!("{}", i + 1),
                original_mm,
                current_mm: original_mm * (1.0 + 0.01 * f64::from(i)),
            }
        })
        .collect();
    let svg = radar_svg("stitches", &axes);
    let (red, blue) = (outlines(&svg, "#c0392b"), outlines(&svg, "#1f5fbf"));
    assert_eq!((red.len(), blue.len()), (1, 1), "one outline each");
    let (red, blue) = (&red[0], &blue[0]);
    assert_eq!((red.len(), blue.len()), (12, 12));
    // The first axis points straight up and the seventh straight down: their common x is the centre's.
    assert!((red[0].0 - red[6].0).abs() < 0.02);
    let centre_x = red[0].0;
    let span = |a: &RadarAxis, b: &RadarAxis| a.original_mm + b.original_mm;
    let per_mm = (red[6].1 - red[0].1) / span(&axes[0], &axes[6]);
    let centre_y = red[0].1 + per_mm * axes[0].original_mm;
    for (i, axis) in axes.iter().enumerate() {
        for (point, mm) in [(red[i], axis.original_mm), (blue[i], axis.current_mm)] {
            let radius = (point.0 - centre_x).hypot(point.1 - centre_y);
            // Coordinates are printed to a hundredth of a pixel.
            assert!((radius / per_mm - mm).abs() < 0.02, "axis {i}: {} mm drawn for {mm} mm", radius / per_mm);
        }
    }
    for label in 1..=12 {
        assert!(svg.contains(&format!(">{label}<")), "label {label}");
    }
}
