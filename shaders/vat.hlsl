// SPDX-License-Identifier: MIT
// Plays vertex animation textures of `sinew bake --to vat`: docs/bake.md. NAME.json has frames, rows, scale and bias.

// What a texture has for a vertex: its offset from where it is at rest, or its normal, which is to be normalised.
//   place      of the vertex, in its UV map for this
//   frame      from 0, with fractions; after the last one the first one follows
//   frames     in the texture
//   rows       of a frame; negative where textures begin at the bottom, as in Unity
float3 sinew_vat(Texture2D animation, float2 place, float frame, int frames, int rows, float3 scale, float3 bias) {
    uint width, height;
    animation.GetDimensions(width, height);
    int2 texel = int2(place * float2(width, height));
    int first = int(floor(frame)) % frames;
    int second = (first + 1) % frames;
    float3 before = animation.Load(int3(texel + int2(0, first * rows), 0)).xyz;
    float3 after = animation.Load(int3(texel + int2(0, second * rows), 0)).xyz;
    return bias + scale * lerp(before, after, frac(frame));
}
