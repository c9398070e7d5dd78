// What all renderers share: the frame's numbers, noise, shadow and light. Put in front of every other shader.
// Light: key lamp with wrapped diffuse (what scatters below the surface comes out redder), two reflections of the
// lamp, sky and ground, a weak light at the eye. Colours are linear until `shown`.

struct Globals {
    clip_from_scene: mat4x4f,
    light_from_scene: mat4x4f,
    // Eye; w: 1 when the target wants gamma-encoded colours.
    eye: vec4f,
    // Towards the lamp; w: strength of its shadow.
    lamp: vec4f,
    // Low corner of the tissue at rest; w: height of the table.
    low: vec4f,
    // High corner; w: side of a shadow texel in the shadow map, 0 to 1.
    high: vec4f,
    // Background; w: radius of the table.
    background: vec4f,
    // Colour of the table; w: 1 for cloth, 0 for paper.
    table: vec4f,
    // End of the scale, time, kind of the scene, how much the table and the sky light the scene.
    scale: vec4f,
    stops: array<vec4f, 9>,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(1) @binding(0) var shadow_map: texture_depth_2d;
@group(1) @binding(1) var shadow_sampler: sampler_comparison;

// Every detail, or what a processor can draw in time.
override FULL: bool = true;

struct Material {
    albedo: vec3f,
    // How far light of each colour is carried round the edge of the light.
    scatter: vec3f,
    // Strength and sharpness of the reflection.
    gloss: f32,
    sharpness: f32,
    // Share of the sky that reaches this place.
    open: f32,
}

fn hash2(p: vec2f) -> f32 {
    var q = fract(p * vec2f(0.1031, 0.1030));
    q += dot(q, q.yx + 33.33);
    return fract((q.x + q.y) * q.x * 7.31);
}

fn hash3(p: vec3f) -> f32 {
    var q = fract(p * vec3f(0.1031, 0.1030, 0.0973));
    q += dot(q, q.yzx + 33.33);
    return fract((q.x + q.y) * q.z);
}

fn noise2(p: vec2f) -> f32 {
    let i = floor(p);
    let f = p - i;
    let u = f * f * (3.0 - 2.0 * f);
    let low = mix(hash2(i), hash2(i + vec2f(1.0, 0.0)), u.x);
    let high = mix(hash2(i + vec2f(0.0, 1.0)), hash2(i + vec2f(1.0, 1.0)), u.x);
    return mix(low, high, u.y);
}

fn noise3(p: vec3f) -> f32 {
    let i = floor(p);
    let f = p - i;
    let u = f * f * (3.0 - 2.0 * f);
    let a = mix(hash3(i), hash3(i + vec3f(1.0, 0.0, 0.0)), u.x);
    let b = mix(hash3(i + vec3f(0.0, 1.0, 0.0)), hash3(i + vec3f(1.0, 1.0, 0.0)), u.x);
    let c = mix(hash3(i + vec3f(0.0, 0.0, 1.0)), hash3(i + vec3f(1.0, 0.0, 1.0)), u.x);
    let d = mix(hash3(i + vec3f(0.0, 1.0, 1.0)), hash3(i + vec3f(1.0, 1.0, 1.0)), u.x);
    return mix(mix(a, b, u.y), mix(c, d, u.y), u.z);
}

// Distance to the nearest of scattered points, and how much farther the second nearest is.
fn cells(p: vec2f) -> vec2f {
    let i = floor(p);
    let f = p - i;
    var nearest = 8.0;
    var second = 8.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let g = vec2f(f32(x), f32(y));
            let h = hash2(i + g);
            let d = g + vec2f(h, fract(h * 57.31)) - f;
            let s = dot(d, d);
            second = min(second, max(nearest, s));
            nearest = min(nearest, s);
        }
    }
    return vec2f(sqrt(nearest), sqrt(second) - sqrt(nearest));
}

// Where a place is in the shadow map; z: how far from the lamp.
fn in_shadow_map(position: vec3f, normal: vec3f) -> vec3f {
    let radius = length(globals.high.xyz - globals.low.xyz);
    let shifted = position + normal * radius * globals.high.w * 2.0;
    let clip = globals.light_from_scene * vec4f(shifted, 1.0);
    return vec3f(0.5 + 0.5 * clip.x, 0.5 - 0.5 * clip.y, clip.z - 0.0015);
}

fn lit_share(in_map: vec3f) -> f32 {
    let at = in_map.xy;
    var share = 0.0;
    if FULL {
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let shift = vec2f(f32(x), f32(y)) * globals.high.w * 1.6;
                share += textureSampleCompareLevel(shadow_map, shadow_sampler, at + shift, in_map.z) / 9.0;
            }
        }
    } else {
        share = textureSampleCompareLevel(shadow_map, shadow_sampler, at, in_map.z);
    }
    let outside = any(at < vec2f(0.0)) || any(at > vec2f(1.0));
    return select(mix(1.0, share, globals.lamp.w), 1.0, outside);
}

// Light that a place sends to the eye, without reflections.
struct Light {
    // Of the sky, of the eye, and of the lamp what scatters into its shadow.
    everywhere: vec3f,
    // Of the lamp, where it reaches.
    from_lamp: vec3f,
}

fn light(m: Material, n: vec3f, to_eye: vec3f) -> Light {
    let facing = dot(n, globals.lamp.xyz);
    let diffuse = saturate((vec3f(facing) + m.scatter) / (vec3f(1.0) + m.scatter));
    let sky = mix(vec3f(0.13, 0.11, 0.11), vec3f(0.30, 0.32, 0.36), 0.5 + 0.5 * n.z) * globals.scale.w * m.open;
    let front = 0.22 * saturate(dot(n, to_eye)) * m.open;
    let lamp = m.albedo * diffuse * vec3f(1.34, 1.29, 1.20) * m.open;
    // What scatters lets the edge of a shadow glow.
    let glow = m.scatter * 0.25;
    return Light(m.albedo * (sky + front) + lamp * glow, lamp * (1.0 - glow));
}

fn lit(m: Material, position: vec3f, normal: vec3f) -> vec3f {
    let to_eye = normalize(globals.eye.xyz - position);
    let n = select(-normal, normal, dot(normal, to_eye) >= 0.0);
    let share = lit_share(in_shadow_map(position, n));
    let l = light(m, n, to_eye);
    let lamp = globals.lamp.xyz;
    let shine = saturate(dot(n, normalize(lamp + to_eye)));
    let away = 1.0 - saturate(dot(n, to_eye));
    let rim = away * away * away * away * away;
    let sharp = pow(shine, m.sharpness) * (m.sharpness + 8.0) * 0.035;
    var broad = 0.0;
    if FULL {
        broad = pow(shine, 0.12 * m.sharpness + 1.0) * 0.10;
    }
    let reflected = (sharp + broad) * share * saturate(dot(n, lamp) * 4.0) + 0.35 * rim * (0.4 + 0.6 * n.z);
    return l.everywhere + l.from_lamp * share + vec3f(m.gloss * reflected * m.open);
}

// The scale's colour of a value.
fn scaled(value: f32) -> vec3f {
    let place = saturate(value / globals.scale.x) * 8.0;
    let below = min(u32(place), 7u);
    let colour = mix(globals.stops[below].rgb, globals.stops[below + 1u].rgb, place - f32(below));
    return pow(colour, vec3f(2.2));
}

// What the target stores.
fn shown(colour: vec3f) -> vec4f {
    // Straight up to 0.7, then bending towards 1.
    let over = max(colour - 0.7, vec3f(0.0));
    let straight = min(colour, vec3f(0.7));
    if FULL {
        return stored(straight + 0.3 * over / (over + 0.3));
    }
    let short = 1.0 - min(over, vec3f(1.0));
    return stored(straight + 0.3 * (1.0 - short * short * short));
}

fn stored(mapped: vec3f) -> vec4f {
    if globals.eye.w > 0.5 {
        if FULL {
            return vec4f(pow(mapped, vec3f(1.0 / 2.2)), 1.0);
        }
        // Within 0.008 of the power from 0 to 1, without a power.
        let root = sqrt(mapped);
        return vec4f(root * (1.19 + root * (0.11 * root - 0.30)), 1.0);
    }
    return vec4f(mapped, 1.0);
}
