//! The test in `uhid` in a kernel of its own: a guest under QEMU without acceleration; needs no rights and no module here.
//!
//! Opt-in: `GUEST_KERNEL=DIR cargo test -p suture-tests --test device -- --ignored guest --nocapture`. `DIR` holds, at any
//! depth, one `vmlinuz…` and of the same build `hid.ko`, `uhid.ko`, `hid-generic.ko`: for instance an unpacked package of
//! Debian (`apt-get download linux-image-6.1.0-50-amd64 && dpkg-deb -x linux-image-*.deb DIR`). Further:
//! `qemu-system-x86_64`, a static `busybox`, `ldd`. What is missing is named, and the test ends there. The guest starts from
//! an archive of busybox, the modules and this very test program with its libraries; the exit status comes back over the
//! serial line. Times inside the guest mean nothing.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use suture_tests::processes::Sandbox;

/// An emulated processor on a loaded machine: a minute is usual.
const LIMIT: Duration = Duration::from_secs(480);
const DEEPEST: u32 = 12;
/// In the order of their needs.
const MODULES: [&str; 3] = ["hid.ko", "uhid.ko", "hid-generic.ko"];
const TEST: &str = "uhid::an_arm_of_the_kernel_is_found_read_written_unplugged_and_found_again";
const STATUS: &str = "exit status of the test in the guest:";
/// The test passes over a missing node, here it must be there: without it 99 comes back.
const INIT: &str = "#!/busybox sh
/busybox mount -t proc proc /proc
/busybox mount -t sysfs sysfs /sys
/busybox mount -t devtmpfs devtmpfs /dev
for module in MODULES; do /busybox insmod /$module; done
status=99
if [ -c /dev/uhid ]; then /device --ignored --exact TEST --nocapture; status=$?; fi
echo; echo \"STATUS $status\"
/busybox reboot -f
";

struct Needs {
    qemu: PathBuf,
    busybox: PathBuf,
    kernel: PathBuf,
    modules: Vec<PathBuf>,
}

fn program(name: &str) -> Result<PathBuf, String> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    found.ok_or_else(|| format!("{name} is not in PATH"))
}

fn files_under(folder: &Path, depth: u32, found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && depth < DEEPEST => files_under(&entry.path(), depth + 1, found),
            Ok(kind) if kind.is_file() => found.push(entry.path()),
            _ => {}
        }
    }
}

fn needs() -> Result<Needs, String> {
    let folder =
        std::env::var_os("GUEST_KERNEL").ok_or("GUEST_KERNEL names no folder with a kernel and its modules")?;
    let mut files = Vec::new();
    files_under(Path::new(&folder), 0, &mut files);
    let named = |fits: &dyn Fn(&str) -> bool, what: &str| {
        let found = files.iter().find(|file| file.file_name().and_then(|n| n.to_str()).is_some_and(fits));
        found.cloned().ok_or_else(|| format!("{} holds no {what}", Path::new(&folder).display()))
    };
    let kernel = named(&|name| name.starts_with("vmlinuz"), "vmlinuz…")?;
    let modules: Result<_, _> = MODULES.iter().map(|module| named(&|name| name == *module, module)).collect();
    Ok(Needs { qemu: program("qemu-system-x86_64")?, busybox: program("busybox")?, kernel, modules: modules? })
}

/// The shared libraries of a program, its loader among them, by their absolute paths.
fn libraries(program: &Path) -> Vec<PathBuf> {
    let listed = Command::new("ldd").arg(program).output().expect("ldd starts");
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    let paths: Vec<PathBuf> = text.split_whitespace().filter(|word| word.starts_with('/')).map(PathBuf::from).collect();
    assert!(!paths.is_empty(), "ldd lists nothing: {text}");
    paths
}

fn put(root: &Path, from: &Path, to: &Path) {
    let to = root.join(to.strip_prefix("/").expect("a path from the root"));
    fs::create_dir_all(to.parent().expect("a folder")).expect("the sandbox is writable");
    fs::copy(from, to).unwrap_or_else(|error| panic!("{}: {error}", from.display()));
}

/// Packs what the guest starts from.
fn pack(sandbox: &Sandbox, needs: &Needs) -> PathBuf {
    let root = sandbox.folder().join("root");
    for folder in ["dev", "proc", "sys", "tmp"] {
        fs::create_dir_all(root.join(folder)).expect("the sandbox is writable");
    }
    put(&root, &needs.busybox, Path::new("/busybox"));
    for (from, name) in needs.modules.iter().zip(MODULES) {
        put(&root, from, &Path::new("/").join(name));
    }
    let own = std::env::current_exe().expect("this program");
    put(&root, &own, Path::new("/device"));
    for library in libraries(&own) {
        put(&root, &library, &library);
    }
    let init = INIT.replace("MODULES", &MODULES.join(" ")).replace("TEST", TEST).replace("STATUS", STATUS);
    fs::write(root.join("init"), init).expect("the sandbox is writable");
    fs::set_permissions(root.join("init"), fs::Permissions::from_mode(0o755)).expect("a file of ours");
    let archive = sandbox.folder().join("start.cpio");
    let packed = Command::new(&needs.busybox)
        .args(["sh", "-c", "\"$0\" find . | \"$0\" cpio -o -H newc >\"$1\""])
        .args([&needs.busybox, &archive])
        .current_dir(&root)
        .output()
        .expect("busybox starts");
    assert!(packed.status.success(), "{}", String::from_utf8_lossy(&packed.stderr));
    archive
}

#[test]
#[ignore = "boots a guest: needs QEMU, busybox and a kernel in the folder GUEST_KERNEL"]
fn the_hidraw_path_works_in_a_guest() {
    let needs = match needs() {
        Ok(needs) => needs,
        Err(missing) => {
            println!("skipped: {missing}");
            return;
        }
    };
    let sandbox = Sandbox::new();
    let archive = pack(&sandbox, &needs);
    let console = sandbox.folder().join("console");
    let [kernel, archive, serial] =
        [&needs.kernel, &archive, &console].map(|path| path.to_str().expect("paths in UTF-8").to_owned());
    let serial = format!("file:{serial}");
    let machine = ["-accel", "tcg", "-m", "512", "-nodefaults", "-display", "none", "-no-reboot", "-serial", &serial];
    let boot = ["-kernel", &kernel, "-initrd", &archive, "-append", "console=ttyS0 panic=-1 quiet"];
    let ended = sandbox.start(&needs.qemu, &[machine.as_slice(), &boot].concat()).wait(LIMIT);
    let told = String::from_utf8_lossy(&fs::read(&console).unwrap_or_default()).into_owned();
    let status = told.lines().find_map(|line| line.trim().strip_prefix(STATUS)).map(str::trim);
    assert_eq!(status, Some("0"), "{ended:?}; the guest's console:\n{told}");
    assert!(told.contains("1 passed") && !told.contains("skipped:"), "the guest's console:\n{told}");
    println!("{told}");
}
