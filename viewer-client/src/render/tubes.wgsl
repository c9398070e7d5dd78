// The suture line: a round tube from point to point. A ring of eight at both ends of a piece, each across the direction
// of its end; both begin at the same side of the piece, or the tube would be wrung between them.

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) along: vec2f,
    @location(3) colour: vec3f,
}

struct Piece {
    // Ends, with their radii.
    @location(0) from_end: vec4f,
    @location(1) to_end: vec4f,
    // Directions at the ends, with the length along the line.
    @location(2) from_direction: vec4f,
    @location(3) to_direction: vec4f,
    @location(4) colour: vec4f,
}

const SIDES: u32 = 8u;

// Vertex k of a strip around the tube.
fn place(k: u32, piece: Piece) -> array<vec3f, 2> {
    let end = (k & 1u) == 1u;
    let at = select(piece.from_end, piece.to_end, end);
    let t = normalize(select(piece.from_direction.xyz, piece.to_direction.xyz, end));
    let middle = normalize(normalize(piece.from_direction.xyz) + normalize(piece.to_direction.xyz) + 1.0e-4 * t);
    let aside = select(vec3f(0.19, 0.27, 0.94), vec3f(0.94, 0.19, 0.27), abs(middle.z) > 0.8);
    let side = cross(middle, aside);
    let u = normalize(side - dot(side, t) * t);
    let v = cross(t, u);
    let turn = f32(k >> 1u) * 6.2831853 / f32(SIDES);
    let normal = cos(turn) * u + sin(turn) * v;
    return array<vec3f, 2>(at.xyz + at.w * normal, normal);
}

@vertex
fn vertex(@builtin(vertex_index) k: u32, piece: Piece) -> Seen {
    let p = place(k, piece);
    let length_m = select(piece.from_direction.w, piece.to_direction.w, (k & 1u) == 1u);
    let along = vec2f(length_m / max(piece.from_end.w, 1.0e-6), f32(k >> 1u) / f32(SIDES));
    return Seen(globals.clip_from_scene * vec4f(p[0], 1.0), p[0], p[1], along, piece.colour.rgb);
}

@vertex
fn shadow(@builtin(vertex_index) k: u32, piece: Piece) -> @builtin(position) vec4f {
    return globals.light_from_scene * vec4f(place(k, piece)[0], 1.0);
}

@fragment
fn fragment(seen: Seen) -> @location(0) vec4f {
    // A braid of several strands.
    let strand = 0.5 + 0.5 * sin(seen.along.x * 1.9 + seen.along.y * 12.566);
    let m = Material(seen.colour * (0.72 + 0.5 * strand), vec3f(0.10), 0.32, 40.0, 1.0);
    return shown(lit(m, seen.position, normalize(seen.normal)));
}
