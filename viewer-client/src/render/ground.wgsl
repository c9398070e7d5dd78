// The table below the tissue: green cloth in a dark room, or paper for print. It catches the shadows and fades into the
// background.

// Cells along a side of the table; a row of them is an instance. A processor lights their corners instead of pixels.
override CELLS: u32 = 1u;

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    // As the target stores it.
    @location(1) colour: vec3f,
}

// Share of the lamp around a corner, as far as the middles of its cells.
fn lit_around(corner: vec3f) -> f32 {
    let cell = 2.0 * globals.background.w / f32(CELLS);
    var share = 0.0;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let near = corner + vec3f(f32(x), f32(y), 0.0) * 0.2 * cell;
            share += lit_share(in_shadow_map(near, vec3f(0.0, 0.0, 1.0))) / 25.0;
        }
    }
    return share;
}

@vertex
fn vertex(@builtin(vertex_index) k: u32, @builtin(instance_index) row: u32) -> Seen {
    let corner = vec2f(f32(k >> 1u), f32(row + (k & 1u))) * 2.0 / f32(CELLS) - 1.0;
    let middle = 0.5 * (globals.low.xy + globals.high.xy);
    let p = vec3f(middle + corner * globals.background.w, globals.low.w);
    var colour = vec3f(0.0);
    if !FULL {
        colour = cloth(p, lit_around(p)).rgb;
    }
    return Seen(globals.clip_from_scene * vec4f(p, 1.0), p, colour);
}

@fragment
fn fragment(seen: Seen) -> @location(0) vec4f {
    if FULL {
        return cloth(seen.position, lit_share(in_shadow_map(seen.position, vec3f(0.0, 0.0, 1.0))));
    }
    return vec4f(seen.colour, 1.0);
}

fn cloth(place: vec3f, share: f32) -> vec4f {
    let middle = 0.5 * (globals.low.xy + globals.high.xy);
    let size = length(globals.high.xyz - globals.low.xyz);
    let away = distance(place.xy, middle) / size;
    let radius = globals.background.w / size;
    let fade = smoothstep(0.25 * radius, 0.99 * radius, away);
    var normal = vec3f(0.0, 0.0, 1.0);
    var albedo = globals.table.rgb;
    if FULL {
        // Folds and weave of the cloth.
        let p = place.xy / size;
        let fold = noise2(p * 3.1 + vec2f(noise2(p * 1.7), 0.0) * 2.0);
        let weave = sin(place.x * 5200.0) * sin(place.y * 5200.0);
        let slope = vec2f(noise2(p * 3.1 + vec2f(0.12, 0.0)) - noise2(p * 3.1), noise2(p * 3.1 + vec2f(0.0, 0.12)) - noise2(p * 3.1));
        normal = normalize(vec3f(-slope * 1.3 * globals.table.w, 1.0));
        albedo *= 1.0 + globals.table.w * (0.22 * (fold - 0.5) + 0.05 * weave * (1.0 - smoothstep(0.4, 1.2, away)));
    }
    // A body over the table takes light from below it.
    let inside = max(abs(place.xy - middle) - 0.5 * (globals.high.xy - globals.low.xy), vec2f(0.0));
    let open = 0.65 + 0.35 * smoothstep(0.0, 0.16, length(inside) / size);
    // Dull: no reflection.
    let light = saturate(dot(normal, globals.lamp.xyz)) * share * 1.28 + (0.34 * globals.scale.w + 0.14) * open;
    return shown(mix(albedo * light, globals.background.rgb, fade));
}
