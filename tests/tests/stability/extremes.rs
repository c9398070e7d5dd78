//! Every extreme case ends correct, clamped and counted, or refused with the reason.

use suture_tests::accuracy::extremes::{Ending, cases};

/// Runs the cases of a group, prints how each ended, and fails with those that ended wrong.
fn group(name: &str) {
    let mut wrong = Vec::new();
    let mut count = 0;
    for case in cases().filter(|c| c.group == name) {
        let outcome = case.run();
        let (figure, limit) = (outcome.figure, outcome.limit);
        let line = format!(
            "{}: {} ({figure:.3e} of {limit:.3e} {}) {}",
            case.name,
            outcome.ending.word(),
            outcome.unit,
            outcome.note
        );
        println!("{line}");
        count += 1;
        if outcome.ending == Ending::Wrong {
            wrong.push(line);
        }
    }
    assert!(count > 0, "no case in the group {name}");
    assert!(wrong.is_empty(), "ended wrong:\n{}", wrong.join("\n"));
}

macro_rules! groups {
    ($($test:ident: $name:literal),* $(,)?) => {
        $(#[test]
        fn $test() {
            group($name);
        })*

        #[test]
        fn every_group_has_its_test() {
            let tested = [$($name),*];
            let missing: Vec<&str> = cases().map(|c| c.group).filter(|g| !tested.contains(g)).collect();
            assert!(missing.is_empty(), "{missing:?}");
        }
    };
}

groups! {
    stiffness_and_mass: "stiffness and mass",
    time: "time",
    geometry: "geometry",
    counts: "counts",
    loads_and_wounds: "loads and wounds",
    attachments: "attachments",
    conservation: "conservation",
    servo: "servo",
    outputs: "outputs",
}

#[test]
fn no_case_has_the_name_of_another() {
    let mut names: Vec<&str> = cases().map(|c| c.name).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}
