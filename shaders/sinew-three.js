// SPDX-License-Identifier: MIT
// three.js plays what the extension SINEW_skinning of a glTF file says, by sinew.glsl beside this file:
//
//     loader.register((parser) => new SinewSkinning(parser));
//
// loader is three.js' GLTFLoader. docs/engines.md says what is left out.
import {
    DataTexture, FloatType, MathUtils, Matrix4, MeshDepthMaterial, MeshDistanceMaterial, Quaternion, RGBADepthPacking,
    RGBAFormat, Skeleton, Vector3,
} from "three";

const NAME = "SINEW_skinning";
const METHODS = { lbs: 0, dq: 1, cor: 2 };
const BY_HIERARCHY = 4;
// Vectors of a bone, and so texels in a row of the texture.
const WIDTH = 8;
const IDENTITY = new Matrix4();

// Axes of unit length, perpendicular to each other: Y as it is, X as near as it can be.
function perpendicular(matrix) {
    const [x, y, z] = [0, 1, 2].map((column) => new Vector3().setFromMatrixColumn(matrix, column));
    y.normalize();
    x.addScaledVector(y, -x.dot(y)).normalize();
    return new Matrix4().makeBasis(x, y, z.crossVectors(x, y));
}

function rotation(matrix) {
    return new Quaternion().setFromRotationMatrix(perpendicular(matrix));
}

function column(matrix, number) {
    return new Vector3().setFromMatrixColumn(matrix, number);
}

// A vector by a matrix, without its translation.
function moved(matrix, vector) {
    return vector.clone().applyMatrix4(matrix).sub(column(matrix, 3));
}

// From 1 at 150 degrees to 0 at 180.
function fade(angle) {
    return 1 - MathUtils.smoothstep(Math.abs(MathUtils.radToDeg(angle)), 150, 180);
}

// The bones of a skinned mesh. Their texture begins as three.js has it, for materials that are not Sinew's, such as
// overrideMaterial of a scene, which skin linearly. The buffer of bones is at its end, from the last row upwards; that
// row has the motion from the space of the file to that of the world.
class SinewSkeleton extends Skeleton {
    // own: of the skin's extension. amount: of Twist Spread
    static of(skeleton, own, amount) {
        return Object.assign(new SinewSkeleton(skeleton.bones, skeleton.boneInverses), { own, amount });
    }

    clone() {
        return SinewSkeleton.of(this, this.own, this.amount);
    }

    computeBoneTexture() {
        const count = this.bones.length, height = Math.ceil(count / 2) + 1 + count;
        this.boneMatrices = new Float32Array(4 * WIDTH * height);
        this.boneTexture = new DataTexture(this.boneMatrices, WIDTH, height, RGBAFormat, FloatType);
        this.rest = this.boneInverses.map((inverse) => inverse.clone().invert());
        this.restRotations = this.rest.map(rotation);
        return this;
    }

    // Of a bone; -1 is the whole file.
    write(bone, vector, ...values) {
        this.boneMatrices.set(values, this.boneMatrices.length - 4 * WIDTH * (bone + 2) + 4 * vector);
    }

    writeMotion(bone, { elements: e }) {
        for (let row = 0; row < 3; ++row) this.write(bone, row, e[row], e[row + 4], e[row + 8], e[row + 12]);
    }

    update() {
        if (this.boneTexture === null) this.computeBoneTexture();
        super.update();
        let file = this.bones[0];
        while (file.parent && !file.userData.isSpaceOfSinew) file = file.parent;
        this.writeMotion(-1, file.matrixWorld);
        const fromWorld = file.matrixWorld.clone().invert();
        const posed = this.bones.map((bone) => fromWorld.clone().multiply(bone.matrixWorld));
        const motions = posed.map((matrix, bone) => matrix.clone().multiply(this.boneInverses[bone]));
        motions.forEach((motion, bone) => this.writeMotion(bone, motion));
        this.writeRotations(posed, motions);
        if (this.own) {
            this.own.lengths.forEach((length, bone) => this.writeSegment(bone, length, motions[bone]));
            this.own.twists.forEach((twist, number) => this.writeTwist(twist, number + 1, motions));
        }
    }

    // Each with the sign that brings it nearest to its parent's; a bone that mirrors counts as its parent.
    writeRotations(posed, motions) {
        const nearby = new Map();
        const visit = (bone) => {
            if (!bone) return new Quaternion();
            const number = this.bones.indexOf(bone);
            if (number < 0) return visit(bone.parent);
            if (!nearby.has(bone)) {
                const before = visit(bone.parent);
                const q = rotation(posed[number]).multiply(this.restRotations[number].clone().conjugate());
                if (q.dot(before) < 0) q.set(-q.x, -q.y, -q.z, -q.w);
                this.write(number, 3, ...q);
                nearby.set(bone, motions[number].determinant() < 0 ? before : q);
            }
            return nearby.get(bone);
        };
        this.bones.forEach(visit);
    }

    // From the head to the tail at rest, and how much the motion stretches what is across the bone, at most.
    writeSegment(bone, length, motion) {
        const rest = this.rest[bone], along = column(rest, 1).multiplyScalar(length);
        let stretch;
        if (length > 0) {
            const image = moved(motion, along), squared = image.lengthSq() || 1, axes = perpendicular(rest);
            const [a, b] = [0, 2].map((axis) => moved(motion, column(axes, axis)));
            for (const v of [a, b]) v.addScaledVector(image, -v.dot(image) / squared);
            // The larger singular value of the two.
            const half = (a.lengthSq() - b.lengthSq()) / 2;
            stretch = Math.sqrt((a.lengthSq() + b.lengthSq()) / 2 + Math.hypot(half, a.dot(b)));
        } else {
            stretch = Math.hypot(...[0, 1, 2].map((axis) => column(motion, axis).length())) / Math.sqrt(3);
        }
        this.write(bone, 4, ...column(rest, 3), stretch);
        this.write(bone, 5, ...along, 0, 0, 0, 0, 0);
    }

    writeTwist({ bone, base, tip, from, amount, curve }, number, motions) {
        // A base without volume: its scale is not known.
        const ofBase = motions[base].determinant() === 0 ? IDENTITY : motions[base];
        const relative = ofBase.clone().invert().multiply(motions[tip]).multiply(this.rest[tip]);
        const q = rotation(relative).multiply(this.restRotations[tip].clone().conjugate());
        const along = column(this.rest[bone], 1).normalize().dot(q) * Math.sign(q.w || 1), w = Math.abs(q.w);
        const angle = 2 * Math.atan2(along, w), swing = 2 * Math.acos(Math.min(Math.hypot(along, w), 1));
        const spread = this.amount * amount * angle * fade(angle) * fade(swing);
        if (spread === 0) return;
        this.write(bone, 5, ...column(this.rest[bone], 1).multiplyScalar(this.own.lengths[bone]), curve);
        this.write(bone, 6, ...(from === "parent" ? [-spread, 0] : [0, spread]), number);
    }
}

// What takes the place of three.js' pieces of vertex shaders, by their names.
// content: of the mesh's extension. attributes: of the geometry
function pieces(glsl, { method, mix = method, parameters = {}, stages = [] }, attributes) {
    const [first, second] = [method, mix].map(
        (name) => METHODS[name] + (parameters[`${name}.signs`] === "hierarchy" ? BY_HIERARCHY : 0),
    );
    const declared = Object.keys(attributes).filter((name) => name.startsWith("_sinew_"));
    const value = (name, without) => (declared.includes(name) ? name : without);
    const amount = (stage, strength = 1) =>
        stages.includes(stage) ? `float(${strength}) * ${value(`_sinew_${stage}`, "1.0")}` : "0.0";
    const centre = value("_sinew_centre", "position"), share = value("_sinew_mix", "0.0");
    const form = parameters["bulge_limit.form"] === "kim_han" ? "SINEW_KIM_HAN" : "SINEW_CONTINUOUS";
    // three.js has made the sum of the first four weights 1.
    const sets = ["skinIndex", "skinWeight"], isEight = "joints_1" in attributes;
    const lists = [...sets, "joints_1", "weights_1"].map((name) => [..."xyzw"].map((axis) => `${name}.${axis}`));
    const joints = (isEight ? [...lists[0], ...lists[2]] : lists[0]).map((name) => `int(${name})`);
    const weights = isEight
        ? [...lists[1].map((name) => `${name} * (1.0 - dot(weights_1, vec4(1.0)))`), ...lists[3]]
        : lists[1];
    const twist = amount("twist_spread"), bulge = amount("bulge_limit", parameters["bulge_limit.strength"]);
    const direction = (name) => `
        ${name} = sinew_to_mesh(vec4(sinew_twist_normal(sinew_normal(${first}, (bindMatrix * vec4(${name}, 0.0)).xyz,
            sinew_joints, sinew_weights), ${twist}, (bindMatrix * vec4(position, 1.0)).xyz, sinew_joints,
            sinew_weights), 0.0));`;
    return {
        skinning_pars_vertex: `#include <skinning_pars_vertex>
            #define SINEW_BONES_DECLARED
            #define SINEW_BONE(bone, k) texelFetch(boneTexture, ivec2(k, textureSize(boneTexture, 0).y - 2 - (bone)), 0)
            #define SINEW_INFLUENCES ${joints.length}
            ${isEight ? "attribute vec4 joints_1, weights_1;" : ""}
            ${declared.map((name) => `attribute ${name === "_sinew_centre" ? "vec3" : "float"} ${name};`).join(" ")}
            ${glsl}
            vec3 sinew_to_mesh(vec4 v) {
                return (bindMatrixInverse * vec4(sinew_by_bone(-1, v), v.w)).xyz;
            }`,
        skinbase_vertex: `
            int sinew_joints[SINEW_INFLUENCES] = int[](${joints});
            float sinew_weights[SINEW_INFLUENCES] = float[](${weights});`,
        skinnormal_vertex: `${direction("objectNormal")}
            #ifdef USE_TANGENT
            ${direction("objectTangent")}
            #endif`,
        skinning_vertex: `
            vec3 sinew_rest = (bindMatrix * vec4(transformed, 1.0)).xyz;
            vec3 sinew_point = sinew_mix(${first}, ${second}, ${share}, sinew_rest,
                (bindMatrix * vec4(${centre}, 1.0)).xyz, sinew_joints, sinew_weights);
            sinew_point = sinew_twist_spread(sinew_point, sinew_linear_share(${first}, ${second}, ${share}), ${twist},
                sinew_rest, sinew_joints, sinew_weights);
            sinew_point = sinew_bulge_limit(sinew_point, ${form}, ${bulge}, sinew_rest, sinew_joints, sinew_weights);
            transformed = sinew_to_mesh(vec4(sinew_point, 1.0));`,
    };
}

function patched(material, found) {
    material.customProgramCacheKey = () => JSON.stringify(found);
    material.onBeforeCompile = (shader) => {
        for (const [name, text] of Object.entries(found)) {
            shader.vertexShader = shader.vertexShader.replace(`#include <${name}>`, () => text);
        }
    };
    return material;
}

export class SinewSkinning {
    constructor(parser) {
        [this.name, this.parser] = [NAME, parser];
    }

    async afterRoot({ scenes }) {
        const { json, associations } = this.parser, skeletons = new Map(), meshes = [];
        for (const scene of scenes) {
            scene.userData.isSpaceOfSinew = true;
            scene.traverse((mesh) => mesh.isSkinnedMesh && meshes.push(mesh));
        }
        const glsl = await (await fetch(new URL("sinew.glsl", import.meta.url))).text();
        for (const mesh of meshes) {
            const content = json.meshes[associations.get(mesh).meshes].extensions?.[NAME];
            if (!content) continue;
            if (![content.method, content.mix ?? "lbs"].every((name) => name in METHODS)) {
                console.warn(`${mesh.name}: sinew.glsl has no method ${content.method} or ${content.mix}`);
                continue;
            }
            const node = associations.get(mesh).nodes ?? associations.get(mesh.parent).nodes;
            const amount = content.parameters?.["twist_spread.amount"] ?? 1;
            const key = `${mesh.skeleton.uuid} ${amount}`;
            if (!skeletons.has(key)) {
                const own = json.skins[json.nodes[node].skin].extensions?.[NAME];
                skeletons.set(key, SinewSkeleton.of(mesh.skeleton, own, amount));
            }
            mesh.bind(skeletons.get(key), mesh.bindMatrix);
            const found = pieces(glsl, content, mesh.geometry.attributes);
            mesh.material = patched(mesh.material.clone(), found);
            mesh.customDepthMaterial = patched(new MeshDepthMaterial({ depthPacking: RGBADepthPacking }), found);
            mesh.customDistanceMaterial = patched(new MeshDistanceMaterial(), found);
        }
    }
}
