//! Table 2: k, c and β of skin, liver and hepatic vessel, from the printed numbers to SI values of the presets.

use sim_core::scene::presets;

/// The table as printed: name, k in N/mm, c in N·s/m, β.
const PRINTED: [(&str, f64, f64, f64); 3] =
    [("skin", 0.16, 3.0, 0.8), ("liver", 0.18, 3.0, 0.6), ("vessel", 0.27, 2.0, 0.4)];

#[test]
fn table2_is_what_the_presets_start_from() {
    for (name, k, c, beta) in PRINTED {
        let scene = presets::by_name(name).expect("the paper's three scenes exist by name");
        assert_eq!(scene.material.stiffness_n_per_mm, k, "{name}");
        assert_eq!(scene.material.drag_n_s_per_m, c, "{name}");
        assert_eq!(scene.attachment.expect("every scene of the paper has attachments").beta, beta, "{name}");
    }
    assert!(presets::by_name("kidney").is_none());
}
