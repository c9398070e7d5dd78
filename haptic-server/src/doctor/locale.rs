//! The locale trap: with a decimal comma the vendor's driver reads and writes its numbers as 0.
//!
//! The sign of it is a position that stays at exactly (0, −110, −35) mm while gimbals and buttons live. The server starts its servo
//! process under `LC_ALL=C`; the vendor's own set-up program, which writes the configuration, runs under the user's locale.
//! `LC_ALL`, `LC_NUMERIC` and `LANG` count in this order (POSIX). Deliberately absent: asking the C library.

use super::check::Check;
use crate::machine::Machine;

/// Languages that write a decimal comma.
const COMMA: [&str; 44] = [
    "af", "az", "be", "bg", "bs", "ca", "cs", "da", "de", "el", "es", "et", "eu", "fi", "fo", "fr", "gl", "hr", "hu",
    "hy", "id", "is", "it", "ka", "kk", "lt", "lv", "mk", "nb", "nl", "nn", "pl", "pt", "ro", "ru", "sk", "sl", "sq",
    "sr", "sv", "tr", "uk", "uz", "vi",
];
/// Countries in which such a language writes a point.
const POINT: [&str; 11] =
    ["de_CH", "de_LI", "it_CH", "es_MX", "es_US", "es_PR", "es_GT", "es_HN", "es_NI", "es_PA", "es_SV"];

/// Whether a locale of this name writes a decimal comma.
pub(super) fn has_decimal_comma(locale: &str) -> bool {
    let place = locale.split(['.', '@']).next().unwrap_or_default();
    let language = place.split('_').next().unwrap_or_default();
    COMMA.contains(&language) && !POINT.contains(&place)
}

/// The row of this family.
pub(super) fn check(machine: &Machine) -> Check {
    let set = ["LC_ALL", "LC_NUMERIC", "LANG"].into_iter().find_map(|name| Some((name, machine.variable(name)?)));
    match set {
        Some((name, value)) if has_decimal_comma(value) => Check::warn(
            "locale",
            format!(
                "{name}={value} writes a decimal comma; the servo runs under LC_ALL=C, the vendor's set-up does not"
            ),
            "start the vendor's set-up as `LC_ALL=C Touch_Setup`; if the position stays at (0, -110, -35), delete its configuration first",
        ),
        Some((name, value)) => Check::ok("locale", format!("{name}={value}, decimal point")),
        None => Check::ok("locale", "none set, decimal point"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;

    #[test]
    fn commas_are_known_by_language_and_country() {
        for (locale, expected) in [
            ("de_DE.UTF-8", true),
            ("fr_CH.UTF-8", true),
            ("de_CH.UTF-8", false),
            ("es_MX", false),
            ("es_ES@euro", true),
            ("en_GB.UTF-8", false),
            ("C.UTF-8", false),
            ("POSIX", false),
            ("zh_CN.UTF-8", false),
            ("", false),
        ] {
            assert_eq!(has_decimal_comma(locale), expected, "{locale}");
        }
    }

    #[test]
    fn the_first_variable_that_is_set_counts() {
        let tree = Tree::new();
        let machine = || tree.machine().with_variable("LANG", "de_DE.UTF-8");
        assert_eq!(check(&machine()).status, Status::Warn);
        assert_eq!(check(&machine().with_variable("LC_NUMERIC", "en_US.UTF-8")).status, Status::Ok);
        let all = machine().with_variable("LC_NUMERIC", "C").with_variable("LC_ALL", "it_IT.UTF-8");
        assert!(check(&all).found.starts_with("LC_ALL=it_IT"));
        assert_eq!(check(&tree.machine()).status, Status::Ok);
    }
}
