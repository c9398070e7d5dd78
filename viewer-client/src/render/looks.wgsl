// What the tissues look like: skin, liver, vessel. All patterns hang on the position at rest, so that they move with the
// tissue. Materials: 0 outer surface, 1 cut or rim, 2 inner surface, 3 wound bed. Put in front of `tissue.wgsl`.

override LOOK: u32 = 0u; // 0 skin, 1 liver, 2 vessel, 3 scale
// Only the outer surface is drawn with this program, or everything but it.
override OUTER: bool = true;

// A processor lights vertices, and adds to each pixel only what is finer: shadow, reflection, grain.
override AT_VERTICES: bool = !FULL && OUTER && LOOK < 3u;
// The triangles are so small that nothing is finer than the vertices.
override DENSE: bool = false;

// A material with its relief in metres and the darkening of a line.
struct Look {
    m: Material,
    relief: f32,
}

// Strength and sharpness of the outer surfaces' reflections.
const SKIN_GLOSS: vec2f = vec2f(0.20, 26.0);
const LIVER_GLOSS: vec2f = vec2f(0.62, 110.0);
const VESSEL_GLOSS: vec2f = vec2f(0.45, 75.0);

fn flesh(rest: vec3f) -> Look {
    // Bundles along the wound.
    let fibre = noise2(vec2f(rest.x * 2600.0, rest.y * 340.0));
    var clot = fibre;
    if FULL {
        clot = noise3(rest * 420.0);
    }
    let red = mix(vec3f(0.20, 0.008, 0.008), vec3f(0.46, 0.045, 0.036), fibre * 0.7 + clot * 0.3);
    return Look(Material(red, vec3f(0.35, 0.05, 0.04), 0.55, 90.0, 0.62), 1.2e-4 * fibre);
}

fn skin(material: f32, depth: f32, rest: vec3f, edge: f32) -> Look {
    if !OUTER {
        if material > 2.5 {
            return flesh(rest);
        }
        // The cut: horny layer, dermis, fat.
        let grain = noise3(rest * 1500.0);
        var lobule = grain;
        if FULL {
            lobule = 2.0 * cells(rest.xy * 900.0 + rest.z * 700.0).y;
        }
        let fat = mix(vec3f(0.80, 0.52, 0.17), vec3f(0.93, 0.72, 0.33), saturate(lobule));
        let dermis = mix(vec3f(0.66, 0.20, 0.16), vec3f(0.80, 0.38, 0.30), grain);
        var colour = mix(dermis, fat, smoothstep(0.40, 0.52, depth + 0.08 * (grain - 0.5)));
        colour = mix(vec3f(0.55, 0.26, 0.17), colour, smoothstep(0.03, 0.09, depth));
        // A cut bleeds, a rim does not.
        let blood = edge * smoothstep(0.25, 0.75, noise2(vec2f(rest.y * 900.0, rest.z * 260.0)) + 0.3);
        colour = mix(colour, vec3f(0.34, 0.012, 0.010), blood * 0.75);
        return Look(Material(colour, vec3f(0.40, 0.12, 0.08), 0.12 + 0.4 * edge, 60.0, 1.0 - 0.30 * depth * edge), 0.0);
    }
    let p = rest.xy * 1000.0;
    let blotch = noise2(p * 0.42 + 31.0);
    var tone = blotch;
    if FULL {
        tone = noise2(p * 0.13);
    }
    var colour = mix(vec3f(0.53, 0.265, 0.170), vec3f(0.66, 0.375, 0.265), tone);
    colour = mix(colour, vec3f(0.62, 0.245, 0.185), 0.55 * smoothstep(0.35, 0.9, blotch));
    var relief = 0.0;
    if FULL {
        // Fields between fine lines, grains in them, and pores.
        let cell = cells(p * 1.55 + 0.5 * vec2f(noise2(p * 0.8), noise2(p * 0.8 + 7.0)));
        let line = 1.0 - smoothstep(0.0, 0.20, cell.y);
        let pores = cells(p * 0.62 + 3.0);
        let pore = 1.0 - smoothstep(0.04, 0.11, pores.x);
        let grain = noise2(p * 5.0);
        colour *= 1.0 - 0.045 * line - 0.16 * pore + 0.06 * (grain - 0.5);
        relief = -2.0e-5 * line - 3.0e-5 * pore + 1.6e-5 * grain + 5.0e-5 * noise2(p * 0.9);
    }
    // Reddened beside the wound, bloody at its very edge.
    let near = edge + 0.25 * (blotch - 0.5) * edge;
    colour = mix(colour, vec3f(0.56, 0.105, 0.080), 0.70 * smoothstep(0.05, 0.95, near));
    colour = mix(colour, vec3f(0.30, 0.012, 0.010), smoothstep(0.74, 0.98, edge + 0.12 * (tone - 0.5)));
    return Look(Material(colour, vec3f(0.34, 0.12, 0.07), SKIN_GLOSS.x, SKIN_GLOSS.y, 1.0), relief);
}

// How far from its middle in shares of the organ's width, and how much of it can be seen.
fn ligament(rest: vec3f) -> vec2f {
    let size = globals.high.xyz - globals.low.xyz;
    let middle = 0.5 * (globals.high.xyz + globals.low.xyz);
    let across = (rest.x - middle.x) / size.x - 0.215 - 0.035 * sin(rest.y * 55.0);
    return vec2f(across, smoothstep(0.10, 0.30, (rest.z - globals.low.z) / size.z));
}

fn in_ligament(place: vec2f) -> f32 {
    return place.y * (1.0 - smoothstep(0.012, 0.026, abs(place.x)));
}

fn liver(material: f32, depth: f32, rest: vec3f, edge: f32) -> Look {
    // A processor gets flat noise, and as little of it as shows a liver.
    var coarse = noise2(rest.xy * 95.0);
    var fine = coarse;
    if FULL || !OUTER {
        coarse = noise3(rest * 95.0);
        fine = noise3(rest * 900.0);
    }
    if !OUTER {
        if material > 2.5 {
            return flesh(rest);
        }
        var colour = mix(vec3f(0.30, 0.030, 0.022), vec3f(0.50, 0.085, 0.055), fine);
        colour = mix(colour, vec3f(0.26, 0.010, 0.010), 0.5 * coarse);
        return Look(Material(colour, vec3f(0.30, 0.05, 0.04), 0.5, 80.0, 1.0 - 0.35 * depth), 1.0e-4 * fine);
    }
    var colour = mix(vec3f(0.215, 0.034, 0.024), vec3f(0.345, 0.066, 0.042), coarse);
    var relief = 2.0e-5 * fine;
    if FULL {
        // Lobules under the capsule.
        let lobule = cells(rest.xy * 1150.0 + rest.z * 300.0);
        let mottle = noise3(rest * 310.0);
        colour *= 0.86 + 0.09 * smoothstep(0.0, 0.4, lobule.y) + 0.16 * mottle;
        relief += 0.9e-5 * smoothstep(0.0, 0.3, lobule.y) + 9.0e-5 * mottle;
    } else {
        colour *= 0.92 + 0.20 * fine;
    }
    // The falciform ligament: a pale band over the organ, right of the wound, and a thin coat of fibres around it.
    let place = ligament(rest);
    let coat = place.y * (1.0 - smoothstep(0.010, 0.11, abs(place.x)));
    if FULL {
        colour = mix(colour, vec3f(0.55, 0.30, 0.22), 0.45 * coat * (0.4 + 0.6 * noise2(rest.xy * vec2f(260.0, 90.0))));
        let strand = noise2(rest.xy * vec2f(2400.0, 170.0));
        let pale = mix(vec3f(0.52, 0.37, 0.28), vec3f(0.76, 0.66, 0.54), strand);
        let band = in_ligament(place);
        colour = mix(colour, pale, 0.92 * band);
        relief += band * (6.0e-4 + 0.7e-4 * strand);
    } else {
        colour = mix(colour, vec3f(0.55, 0.30, 0.22), 0.32 * coat);
    }
    colour = mix(colour, vec3f(0.34, 0.012, 0.010), 0.7 * smoothstep(0.45, 1.0, edge));
    return Look(Material(colour, vec3f(0.22, 0.05, 0.04), LIVER_GLOSS.x, LIVER_GLOSS.y, 1.0), relief);
}

// Place among the fibres that run round the vessel.
fn fibres(rest: vec3f) -> vec2f {
    let turn = atan2(rest.x - 0.5 * (globals.low.x + globals.high.x), rest.z - 0.5 * (globals.low.z + globals.high.z));
    return vec2f(turn * 18.0, rest.y * 500.0);
}

fn vessel(material: f32, depth: f32, rest: vec3f, edge: f32) -> Look {
    let place = fibres(rest);
    let sheet = place * vec2f(1.0 / 3.0, 2.0);
    if !OUTER && material > 1.5 {
        // Lining, seen through the slit.
        let fold = noise2(vec2f(sheet.x * 1.6, sheet.y * 0.25));
        let colour = mix(vec3f(0.52, 0.13, 0.10), vec3f(0.66, 0.25, 0.19), fold);
        return Look(Material(colour, vec3f(0.35, 0.08, 0.06), 0.5, 70.0, 0.55), 1.0e-4 * fold);
    }
    var fibre = 0.5;
    if !AT_VERTICES {
        fibre = noise2(place);
    }
    if !OUTER {
        // Three coats: pale outer coat, red muscle, white lining; a thin dark membrane between them.
        let wave = depth + 0.03 * (fibre - 0.5);
        var colour = mix(vec3f(0.86, 0.66, 0.56), vec3f(0.66, 0.13, 0.10), smoothstep(0.30, 0.35, wave));
        colour = mix(colour, vec3f(0.92, 0.80, 0.68), smoothstep(0.74, 0.78, wave));
        let membrane = min(abs(wave - 0.325), abs(wave - 0.76));
        colour *= 1.0 - 0.6 * (1.0 - smoothstep(0.0, 0.035, membrane));
        return Look(Material(colour, vec3f(0.35, 0.12, 0.10), 0.3, 50.0, 1.0 - 0.2 * depth), 0.0);
    }
    var blotch = fibre;
    if FULL {
        blotch = noise2(sheet * vec2f(0.35, 0.16) + 3.0);
    }
    var colour = mix(vec3f(0.66, 0.27, 0.22), vec3f(0.82, 0.50, 0.41), fibre * 0.55 + blotch * 0.45);
    var relief = 6.0e-5 * fibre;
    if FULL {
        // Small vessels of the vessel.
        let bend = vec2f(noise2(sheet * 0.3), noise2(sheet * 0.3 + 11.0)) * 2.2;
        let branch = abs(noise2(sheet * vec2f(0.55, 0.22) + bend) - 0.5);
        let vein = (1.0 - smoothstep(0.012, 0.045, branch)) * smoothstep(0.35, 0.65, blotch);
        colour = mix(colour, vec3f(0.50, 0.075, 0.07), 0.55 * vein);
        relief += 1.5e-5 * vein;
    }
    colour = mix(colour, vec3f(0.48, 0.05, 0.04), 0.7 * smoothstep(0.35, 1.0, edge));
    return Look(Material(colour, vec3f(0.34, 0.13, 0.10), VESSEL_GLOSS.x, VESSEL_GLOSS.y, 1.0), relief);
}

fn own_look(material: f32, depth: f32, rest: vec3f, edge: f32) -> Look {
    if LOOK == 0u {
        return skin(material, depth, rest, edge);
    }
    if LOOK == 1u {
        return liver(material, depth, rest, edge);
    }
    return vessel(material, depth, rest, edge);
}
