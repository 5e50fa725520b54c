// SPDX-License-Identifier: MIT
// A grid on the ground, in lines that fade out.

struct Uniforms {
    @align(16) clip_from_world: mat4x4f,
    @align(16) middle: vec3f,
    @align(16) radius: f32,
    @align(16) spacing: f32,
    @align(16) line: vec3f,
}
@group(0) @binding(0) var<uniform> uniforms: Uniforms;

struct End {
    @builtin(position) place: vec4f,
    @location(0) share: f32,
}

@vertex
fn place(@builtin(vertex_index) vertex: u32) -> End {
    let piece = vertex >> 1u;
    let line = piece / PIECES;
    let across = (f32(line % LINES) - f32(LINES / 2u)) * uniforms.spacing;
    let along = (2.0 * f32(piece % PIECES + (vertex & 1u)) / f32(PIECES) - 1.0) * uniforms.radius;
    let own = select(vec2f(along, across), vec2f(across, along), line < LINES);
    let start = floor(uniforms.middle.xy / uniforms.spacing + 0.5) * uniforms.spacing;
    let clip = uniforms.clip_from_world * vec4f(start + own, uniforms.middle.z, 1.0);
    // Depth is from 0 to 1 here.
    let share = 1.0 - smoothstep(0.1, 1.0, length(own) / uniforms.radius);
    return End(vec4f(clip.xy, 0.5 * (clip.z + clip.w), clip.w), share);
}

@fragment
fn shade(end: End) -> @location(0) vec4f {
    return 0.3 * end.share * vec4f(uniforms.line, 1.0);
}
