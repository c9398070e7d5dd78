// Makes the tissue's vertices from the nodes: smooth normals, points between nodes, wound walls and wound bed.
// Three passes over one array: vertices at nodes, then points on curved faces (Phong tessellation, Boubekeur and Alexa
// 2008), then vertices below others. A pass reads only what an earlier pass has written.

struct Counts {
    plain: u32,
    curved: u32,
    below: u32,
    colour: u32,
}

struct Vertex {
    // Position; w: material.
    position: vec4f,
    // Normal; w: how deep in the tissue, 0 outside to 1 inside.
    normal: vec4f,
    // Position at rest; w: value for the scale.
    rest: vec4f,
    // Wound edge, held by a hand, -, -.
    marks: vec4f,
}

// A point between vertices, or below one.
struct Made {
    a: u32,
    b: u32,
    c: u32,
    // Vertex whose normal and material count, or the absent one.
    other: u32,
    share_b: f32,
    share_c: f32,
    depth_m: f32,
    // Material, depth in the tissue · 255 << 8, kind << 24.
    info: u32,
}

const ABSENT: u32 = 0xffffffffu;
// How far a face bulges towards the tangent planes of its corners.
const BULGE: f32 = 0.75;
const WALL: u32 = 1u;
const BED: u32 = 2u;

@group(0) @binding(0) var<uniform> counts: Counts;
// Seven words a node: position, attachment force, spring force, strain, flags.
@group(0) @binding(1) var<storage, read> nodes: array<u32>;
@group(0) @binding(2) var<storage, read> rest: array<u32>;
// Node, first and number of its faces, material | depth · 255 << 8 | edge << 16.
@group(0) @binding(3) var<storage, read> plain: array<vec4u>;
// The other two corners of a face.
@group(0) @binding(4) var<storage, read> faces: array<vec2u>;
@group(0) @binding(5) var<storage, read> made: array<Made>;
@group(0) @binding(6) var<storage, read_write> shaped: array<Vertex>;

fn place(node: u32) -> vec3f {
    let at = 7u * node;
    return vec3f(bitcast<f32>(nodes[at]), bitcast<f32>(nodes[at + 1u]), bitcast<f32>(nodes[at + 2u]));
}

fn rest_place(node: u32) -> vec3f {
    let at = 7u * node;
    return vec3f(bitcast<f32>(rest[at]), bitcast<f32>(rest[at + 1u]), bitcast<f32>(rest[at + 2u]));
}

fn value(node: u32) -> f32 {
    let at = 7u * node;
    switch counts.colour {
        case 1u: { return 100.0 * bitcast<f32>(nodes[at + 5u]); }
        case 2u: { return bitcast<f32>(nodes[at + 4u]); }
        case 3u: { return bitcast<f32>(nodes[at + 3u]); }
        case 4u: { return f32(nodes[at + 6u] & 1u); }
        default: { return 0.0; }
    }
}

fn unit(v: vec3f) -> vec3f {
    let size = length(v);
    if size > 1.0e-20 {
        return v / size;
    }
    return vec3f(0.0, 0.0, 1.0);
}

fn index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

@compute @workgroup_size(64)
fn at_nodes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = index(id, groups);
    if i >= counts.plain {
        return;
    }
    let vertex = plain[i];
    let here = place(vertex.x);
    var sum = vec3f(0.0);
    for (var f = vertex.y; f < vertex.y + vertex.z; f++) {
        let corners = faces[f];
        sum += cross(place(corners.x) - here, place(corners.y) - here);
    }
    let depth = f32((vertex.w >> 8u) & 0xffu) / 255.0;
    let edge = f32((vertex.w >> 16u) & 1u);
    let held = f32((nodes[7u * vertex.x + 6u] >> 1u) & 1u);
    shaped[i].position = vec4f(here, f32(vertex.w & 0xffu));
    // Areas are of the order of a square millimetre: scaled before the length is taken.
    shaped[i].normal = vec4f(unit(sum * 1.0e6), depth);
    shaped[i].rest = vec4f(rest_place(vertex.x), value(vertex.x));
    shaped[i].marks = vec4f(edge, held, 0.0, 0.0);
}

fn pulled(p: vec3f, corner: u32) -> vec3f {
    let n = shaped[corner].normal.xyz;
    return p - dot(p - shaped[corner].position.xyz, n) * n;
}

@compute @workgroup_size(64)
fn on_faces(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = index(id, groups);
    if i >= counts.curved {
        return;
    }
    let m = made[i];
    let shares = vec3f(1.0 - m.share_b - m.share_c, m.share_b, m.share_c);
    let flat = shares.x * shaped[m.a].position.xyz + shares.y * shaped[m.b].position.xyz
        + shares.z * shaped[m.c].position.xyz;
    let curved = shares.x * pulled(flat, m.a) + shares.y * pulled(flat, m.b) + shares.z * pulled(flat, m.c);
    var normal = shares.x * shaped[m.a].normal + shares.y * shaped[m.b].normal + shares.z * shaped[m.c].normal;
    if m.other != ABSENT {
        // On a wall: the corners of the wall say where it faces; `c` has no share then.
        normal = shares.x * shaped[m.c].normal + shares.y * shaped[m.other].normal;
    }
    let at = counts.plain + i;
    shaped[at].position = vec4f(mix(flat, curved, BULGE), f32(m.info & 0xffu));
    shaped[at].normal = vec4f(unit(normal.xyz), f32((m.info >> 8u) & 0xffu) / 255.0);
    shaped[at].rest = shares.x * shaped[m.a].rest + shares.y * shaped[m.b].rest + shares.z * shaped[m.c].rest;
    shaped[at].marks = shares.x * shaped[m.a].marks + shares.y * shaped[m.b].marks + shares.z * shaped[m.c].marks;
}

@compute @workgroup_size(64)
fn below_others(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = index(id, groups);
    if i >= counts.below {
        return;
    }
    let m = made[counts.curved + i];
    let at = counts.plain + counts.curved + i;
    let kind = m.info >> 24u;
    var top = shaped[m.a];
    var out = top.normal.xyz;
    if kind == BED {
        let other = shaped[m.b];
        top.position = mix(top.position, other.position, m.share_b);
        top.rest = mix(top.rest, other.rest, m.share_b);
        out = unit(mix(out, other.normal.xyz, m.share_b));
    }
    var normal = out;
    if kind == WALL {
        normal = unit(cross(shaped[m.c].position.xyz - shaped[m.b].position.xyz, out) * 1.0e3);
    }
    shaped[at].position = vec4f(top.position.xyz - m.depth_m * out, f32(m.info & 0xffu));
    shaped[at].normal = vec4f(normal, f32((m.info >> 8u) & 0xffu) / 255.0);
    shaped[at].rest = vec4f(top.rest.xyz - m.depth_m * vec3f(0.0, 0.0, 1.0), top.rest.w);
    shaped[at].marks = top.marks;
}
