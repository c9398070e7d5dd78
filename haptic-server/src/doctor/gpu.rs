//! What a picture could be drawn with: a look at files, nothing is rendered.
//!
//! Vulkan needs its loader, a driver's manifest (`icd.d`), and for a graphics card a render node that this user may open; the
//! software driver (lavapipe) needs no node. Server and solver need none of it, and `viewer-client --text` neither: nothing here fails.

use super::check::Check;
use crate::machine::Machine;

/// Folders of driver manifests.
const MANIFESTS: [&str; 4] =
    ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/local/etc/vulkan/icd.d"];
/// Folders of libraries.
const LIBRARIES: [&str; 4] = ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"];

/// The row of this family.
pub(super) fn check(machine: &Machine) -> Check {
    let nodes: Vec<String> = machine.names("/dev/dri").into_iter().filter(|n| n.starts_with("renderD")).collect();
    let usable = nodes.iter().filter(|n| machine.is_usable(&format!("/dev/dri/{n}"))).count();
    let drivers: Vec<String> = MANIFESTS.iter().flat_map(|folder| machine.names(folder)).collect();
    let has_software = drivers.iter().any(|d| d.starts_with("lvp_"));
    let has = |library: &str| LIBRARIES.iter().any(|folder| machine.has(&format!("{folder}/{library}")));
    let found = format!(
        "looked, not drawn: {} render node(s), {usable} usable; Vulkan loader {}; drivers: {}; OpenGL {}",
        nodes.len(),
        if has("libvulkan.so.1") { "there" } else { "missing" },
        if drivers.is_empty() { "none".to_owned() } else { drivers.join(" ") },
        if has("libGL.so.1") || has("libEGL.so.1") { "there" } else { "missing" },
    );
    let is_complete = has("libvulkan.so.1") && (has_software || usable > 0 && !drivers.is_empty());
    let remedy = if !nodes.is_empty() && usable == 0 && !has_software {
        format!("as root: usermod -aG render,video {}; then log in again", machine.user_name())
    } else {
        "only viewers need it: apt install libvulkan1 mesa-vulkan-drivers".to_owned()
    };
    if is_complete { Check::ok("gpu", found) } else { Check::warn("gpu", found, remedy) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;

    #[test]
    fn a_card_needs_its_node_and_the_software_driver_does_not() {
        let nothing = Tree::new();
        assert_eq!(check(&nothing.machine()).status, Status::Warn);
        let loader = nothing.with("usr/lib64/libvulkan.so.1", "");
        let card = loader.with("dev/dri/renderD128", "").with("usr/share/vulkan/icd.d/intel_icd.x86_64.json", "{}");
        assert_eq!(check(&card.machine()).status, Status::Ok);
        let locked = check(&card.locked());
        assert_eq!(locked.status, Status::Warn);
        assert!(locked.remedy.is_some_and(|r| r.contains("render,video")));
        let software = card.with("usr/share/vulkan/icd.d/lvp_icd.x86_64.json", "{}");
        assert_eq!(check(&software.locked()).status, Status::Ok);
        assert!(check(&software.locked()).found.contains("not drawn"));
    }
}
