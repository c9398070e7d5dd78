//! Every shader passes validation, whole as it is compiled, on every adapter of this machine.

use viewer_client::gpu::{Gpu, finish};
use viewer_client::render::shaders;
use viewer_tests::adapters;

/// What the device says about a shader.
fn fault(gpu: &Gpu, name: &str, source: &str) -> Option<String> {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let info = finish(module.get_compilation_info());
    let errors = info.messages.iter().filter(|m| m.message_type == wgpu::CompilationMessageType::Error).count();
    let error = finish(scope.pop()).map(|e| e.to_string());
    assert_eq!(errors > 0, error.is_some(), "{name}");
    error
}

#[test]
fn every_shader_is_valid() {
    for gpu in adapters() {
        for (name, source) in shaders() {
            assert_eq!(fault(&gpu, name, &source), None, "{name} on {}", gpu.describe());
            // A shader that lacks a line is refused: the check above can fail.
            let broken = source.replacen("let ", "lte ", 1);
            assert!(fault(&gpu, name, &broken).is_some(), "{name} with a fault passes on {}", gpu.describe());
        }
    }
}

#[test]
fn every_shader_file_is_part_of_one_of_them() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../viewer-client/src/render");
    let files = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{folder}: {e}"));
    let paths = files.filter_map(|f| Some(f.ok()?.path())).filter(|p| p.extension().is_some_and(|e| e == "wgsl"));
    let mut count = 0;
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(shaders().iter().any(|(_, source)| source.contains(text.trim_end())), "{}", path.display());
        count += 1;
    }
    assert!(count >= shaders().len());
}
