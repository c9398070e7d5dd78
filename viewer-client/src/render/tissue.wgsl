// The tissue: skin, liver or vessel by its own look (`looks.wgsl`), or coloured by a value.

// Colour of what a hand holds, and how much of it is mixed in.
const HELD: vec3f = vec3f(1.0, 0.86, 0.35);
const HELD_SHARE: f32 = 0.16;

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) position: vec4f,
    @location(1) normal: vec4f,
    @location(2) rest: vec4f,
    @location(3) marks: vec4f,
    // What a processor works out at the vertices of the outer surface: light everywhere, and where the lamp reaches;
    // w: place in the pattern that is finer than the vertices.
    @location(4) everywhere: vec4f,
    @location(5) from_lamp: vec4f,
    // From the middle between lamp and eye to the normal: its square is twice what the cosine lacks to 1.
    @location(6) askew: vec3f,
    @location(7) in_map: vec3f,
}

@vertex
fn shadow(@location(0) position: vec4f) -> @builtin(position) vec4f {
    return globals.light_from_scene * vec4f(position.xyz, 1.0);
}

@vertex
fn vertex(
    @location(0) position: vec4f,
    @location(1) normal: vec4f,
    @location(2) rest: vec4f,
    @location(3) marks: vec4f,
) -> Seen {
    var seen: Seen;
    seen.clip = globals.clip_from_scene * vec4f(position.xyz, 1.0);
    seen.position = position;
    seen.normal = normal;
    seen.rest = rest;
    seen.marks = marks;
    if AT_VERTICES {
        let m = own_look(0.0, normal.w, rest.xyz, saturate(marks.x)).m;
        let n = normal.xyz;
        let to_eye = normalize(globals.eye.xyz - position.xyz);
        let l = light(m, n, to_eye);
        let away = 1.0 - saturate(dot(n, to_eye));
        let rim = 0.35 * away * away * away * away * away * (0.4 + 0.6 * n.z);
        let held = HELD_SHARE * saturate(marks.y);
        let pattern = fine_place(rest.xyz);
        seen.everywhere = vec4f(mix(l.everywhere + m.gloss * m.open * rim, HELD, held), pattern.x);
        seen.from_lamp = vec4f(l.from_lamp * (1.0 - held), pattern.y);
        seen.askew = n - normalize(globals.lamp.xyz + to_eye);
        if LOOK == 0u {
            // Broad enough for the vertices.
            seen.from_lamp += vec4f(vec3f(shine(seen.askew, SKIN_GLOSS)), 0.0);
        }
        seen.in_map = in_shadow_map(position.xyz, n);
        if DENSE {
            seen.everywhere = with_grain(seen, lit_around(seen.in_map));
        }
    }
    return seen;
}

// Place in the pattern that is finer than the vertices.
fn fine_place(rest: vec3f) -> vec2f {
    if LOOK == 1u {
        return ligament(rest);
    }
    if LOOK == 2u {
        return fibres(rest);
    }
    return rest.xy * 2600.0;
}

// Share of the lamp around a vertex, about as far as its neighbours.
fn lit_around(in_map: vec3f) -> f32 {
    var share = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let shift = vec2f(f32(x), f32(y)) * 2.0 * globals.high.w;
            share += lit_share(vec3f(in_map.xy + shift, in_map.z)) / 9.0;
        }
    }
    return share;
}

// What is finer than the vertices.
fn with_grain(seen: Seen, share: f32) -> vec4f {
    let place = vec2f(seen.everywhere.w, seen.from_lamp.w);
    var colour = seen.everywhere.rgb + seen.from_lamp.rgb * share;
    if LOOK == 0u {
        return shown(colour * (0.93 + 0.12 * noise2(place)));
    }
    var gloss = LIVER_GLOSS;
    if LOOK == 1u {
        let strand = abs(fract(seen.rest.x * 668.0) - 0.5);
        colour *= mix(vec3f(1.0), vec3f(1.7, 3.1, 3.5) + strand, in_ligament(place));
    } else {
        gloss = VESSEL_GLOSS;
        colour *= mix(vec3f(0.93, 0.80, 0.79), vec3f(1.06, 1.19, 1.20), noise2(place));
    }
    return shown(colour + share * shine(seen.askew, gloss));
}

// The reflection of the lamp: the power of a cosine near 1.
fn shine(askew: vec3f, gloss: vec2f) -> f32 {
    let near = saturate(1.0 - gloss.y / 16.0 * dot(askew, askew));
    let squared = near * near;
    let fourth = squared * squared;
    return gloss.x * (gloss.y + 8.0) * 0.035 * fourth * fourth;
}

@fragment
fn fragment(seen: Seen) -> @location(0) vec4f {
    if AT_VERTICES {
        if DENSE {
            return seen.everywhere;
        }
        return with_grain(seen, lit_share(seen.in_map));
    }
    if LOOK == 3u {
        if !OUTER {
            // Cut faces and what lies beneath have no nodes of their own to colour.
            let grey = Material(vec3f(0.30), vec3f(0.0), 0.05, 24.0, 1.0);
            return shown(lit(grey, seen.position.xyz, normalize(seen.normal.xyz)));
        }
        // As in the legend: no lamp, no shadow, no gloss; only a little darker where the face turns away.
        let to_eye = normalize(globals.eye.xyz - seen.position.xyz);
        let turned = 1.0 - abs(dot(normalize(seen.normal.xyz), to_eye));
        return stored(scaled(seen.rest.w) * (1.0 - 0.35 * turned * turned));
    }
    let look = own_look(floor(seen.position.w + 0.5), seen.normal.w, seen.rest.xyz, saturate(seen.marks.x));
    var normal = normalize(seen.normal.xyz);
    if FULL {
        // The relief as a change of the normal (Mikkelsen 2010, unparametrised bump mapping).
        let px = dpdx(seen.position.xyz);
        let py = dpdy(seen.position.xyz);
        // Where a pixel is larger than the pattern, the relief is left out.
        let foot = max(length(px), length(py));
        let seen_relief = 1.0 - smoothstep(0.8e-4, 3.0e-4, foot);
        let rise = vec2f(dpdx(look.relief), dpdy(look.relief)) * seen_relief;
        let r1 = cross(py, normal);
        let r2 = cross(normal, px);
        let det = dot(px, r1);
        let slope = sign(det) * (rise.x * r1 + rise.y * r2);
        let bent = abs(det) * normal - clamp(slope, vec3f(-0.8 * abs(det)), vec3f(0.8 * abs(det)));
        normal = normalize(select(normal, bent, abs(det) > 1.0e-16));
    }
    var colour = lit(look.m, seen.position.xyz, normal);
    colour = mix(colour, HELD, HELD_SHARE * saturate(seen.marks.y));
    return shown(colour);
}
