// SPDX-License-Identifier: MIT
// Plays vertex animation textures of `sinew bake --to vat`: docs/bake.md. NAME.json has frames, rows, scale and bias.

// What a texture has for a vertex: its offset from where it is at rest, or its normal, which is to be normalised.
//   animation  highp, as OpenGL ES may otherwise read half floats
//   place      of the vertex, in its UV map for this
//   frame      from 0, with fractions; after the last one the first one follows
//   frames     in the texture
//   rows       of a frame; negative where textures begin at the bottom
vec3 sinew_vat(highp sampler2D animation, vec2 place, float frame, int frames, int rows, vec3 scale, vec3 bias) {
    ivec2 texel = ivec2(place * vec2(textureSize(animation, 0)));
    int first = int(floor(frame)) % frames;
    int second = (first + 1) % frames;
    vec3 before = texelFetch(animation, texel + ivec2(0, first * rows), 0).xyz;
    vec3 after = texelFetch(animation, texel + ivec2(0, second * rows), 0).xyz;
    return bias + scale * mix(before, after, fract(frame));
}
