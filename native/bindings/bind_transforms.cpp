// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"
#include "sinew/interpolate/spherical.h"
#include "sinew/transform/rigid_distance.h"
#include "sinew/transform/split_scale.h"

namespace sinew::bindings {
namespace {

// Raises ValueError if `a` is a matrix that scales, shears or mirrors, which no quaternion can represent.
template <class X>
void check_rigid(const X& a, const char* argument) {
    if constexpr (requires { a.linear; }) {
        if (!is_rigid(a))
            fail(argument, "rigid transforms, as normalized() makes them", "one that is not rigid");
    }
}

/// `f` of a rigid argument `a`.
template <class F>
auto of_rigid(F f) {
    return [f](const auto& a) {
        check_rigid(a, "a");
        return f(a);
    };
}

// The functions of every representation.
template <template <class> class X>
void bind_representation(py::module_& m) {
    m.def(
        "identity",
        [](const Typed<"numpy.typing.DTypeLike">& dtype) -> Array {
            Output<X<double>> output(Shape{});
            output.write(0, X<double>{});
            return output.take().attr("astype")(dtype);
        },
        py::arg_v("dtype", py::module_::import("numpy").attr("float64"), "numpy.float64"),
        "The identity, one transform.");
    def<Vec3, Scalar>(
        m, "from_axis_angle", {"axis", "angle"},
        [](const auto& axis, auto angle) { return from_axis_angle<X>(axis, angle); },
        R"(The rotation by `angle` radians, [..], about `axis`, [.., 3], through the origin. The axis may have any
length; 0 gives the identity.)");
    def<Mat3>(
        m, "from_rotation_matrix", {"rotation"},
        []<class T>(const Mat3<T>& rotation) {
            if constexpr (!std::is_same_v<X<T>, Affine<T>>) {
                check_rigid(Affine<T>{rotation, Vec3<T>(T(0))}, "rotation");
            }
            return from_rotation_matrix<X>(rotation);
        },
        "The rotation by a matrix, [.., 3, 3]: a rotation to within 2e-3, or for sinew.affine any matrix.");
    def<Vec3>(
        m, "from_translation", {"translation"},
        [](const auto& translation) { return from_translation<X>(translation); },
        "The translation by `translation`, [.., 3].");
    def<Vec3, Vec3, Scalar, Scalar>(
        m, "from_screw", {"axis", "moment", "angle", "translation"},
        []<class T>(const Vec3<T>& axis, const Vec3<T>& moment, T angle, T translation) {
            return to<X>(Screw<T>{axis, moment, angle, translation});
        },
        R"(The rotation by `angle` radians about a line with a translation along it, both [..]; inverse of to_screw()
(Daniilidis 1999, eq. 13).

axis, moment: [.., 3], Pluecker coordinates of the line. Both are divided by the length of the axis, and a
    component of the moment along it is ignored. An axis of length 0 gives the identity.)");
    def<Vec3, Vec3, Scalar, Scalar>(
        m, "from_screw_about", {"axis", "point", "angle", "translation"},
        [](const auto& axis, const auto& point, auto angle, auto translation) {
            return to<X>(screw_about(axis, point, angle, translation));
        },
        "As from_screw(), with the line given by any of its points, `point`, [.., 3].");
    def<X>(m, "to_screw", {"a"}, of_rigid([](const auto& a) {
               const auto screw = to_screw(a);
               return named<"Screw">(screw.axis, screw.moment, screw.angle, screw.translation, screw.pitch());
           }),
           R"(The screw of rigid `a` (Chasles 1830).

The angle is 0 to pi; at pi the axis has one of its two directions. The moment is point x axis. The pitch is
translation / angle; it is infinite for a pure translation, for which the axis is its direction, angle and
moment are 0 and translation >= 0. The axis of the identity is z.)");
    def<Twist>(
        m, "from_twist", {"twist"}, [](const auto& twist) { return to<X>(twist); },
        "The exponential of `twist`, [.., 6]: angular velocity, then linear velocity, of any angle.");
    def<X>(
        m, "to_twist", {"a"}, of_rigid([](const auto& a) { return to_twist(a); }),
        R"(The logarithm of rigid `a` in se(3), [.., 6]: angular, then linear, with an angle of 0 to pi. At 180
degrees it has one of the two directions of the axis.)");
    const auto def_conversion = [&](const char* name, auto f, const char* doc) {
        def<X>(m, name, {"a"}, f, doc);
    };
    if constexpr (!std::is_same_v<X<double>, Affine<double>>) {
        def_conversion(
            "to_affine", [](const auto& a) { return to<Affine>(a); },
            "`a` in the layout of sinew.affine, [.., 4, 4].");
    }
    if constexpr (!std::is_same_v<X<double>, QuatVec<double>>) {
        def_conversion(
            "to_quat_vec", of_rigid([](const auto& a) { return to<QuatVec>(a); }),
            "Rigid `a` in the layout of sinew.quat_vec, [.., 7]. The length of quaternions is not checked.");
    }
    if constexpr (!std::is_same_v<X<double>, DualQuat<double>>) {
        def_conversion(
            "to_dual_quat", of_rigid([](const auto& a) { return to<DualQuat>(a); }),
            "Rigid `a` in the layout of sinew.dual_quat, [.., 8]. The length of quaternions is not checked.");
    }
    def<X, X>(
        m, "compose", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; },
        R"(The product a b, which applies `b` first: compose(model_from_bone, bone_from_rest) is
model_from_rest.)");
    def<X>(
        m, "inverse", {"a"},
        [](const auto& a) {
            if constexpr (requires { a.linear; }) {
                if (glm::determinant(a.linear) == 0)
                    fail("a", "an invertible transform", "one of determinant 0");
            }
            return inverse(a);
        },
        "The inverse of `a`. ValueError if the linear part of a matrix is singular.");
    def<X>(
        m, "normalized", {"a"}, [](const auto& a) { return normalized(a); },
        R"(The rigid transform nearest to `a`. A matrix's linear part becomes the nearest rotation (polar
decomposition), or one of several, as for rank 0 or 1. A quaternion is divided by its length, a dual quaternion
by its norm; 0 gives the identity.)");
    def<X, Vec3>(
        m, "transform_point", {"a", "points"},
        [](const auto& a, const auto& point) { return transform_point(a, point); },
        "The images of `points`, [.., 3], under `a`. For n transforms of m points each, use a[:, None].");
    def<X, Vec3>(
        m, "transform_vector", {"a", "vectors"},
        [](const auto& a, const auto& vector) { return transform_vector(a, vector); },
        "The images of `vectors`, [.., 3], under `a` without its translation.");
    def<X, Vec3>(
        m, "transform_normal", {"a", "normals"},
        [](const auto& a, const auto& normal) { return transform_normal(a, normal); },
        R"(The unit normals, [.., 3], of surfaces after `a`: by the inverse transpose of a matrix. 0 for 0, and for a
surface that becomes a line.)");
    def<X, X>(
        m, "rigid_distance", {"a", "b"},
        [](const auto& a, const auto& b) {
            check_rigid(a, "a");
            check_rigid(b, "b");
            const auto apart = rigid_distance(a, b);
            return named<"Distance">(apart.angle, apart.translation);
        },
        R"(The distance of rigid `b` from rigid `a`, [..]: the angle of the rotation, 0 to pi, and the distance
between the images of the origin. It is the same for compose(x, a) and compose(x, b) with rigid x.)");
}

void bind_dual_quaternions(py::module_& m) {
    def<DualQuat>(
        m, "conjugate", {"a"}, [](const auto& a) { return conjugate(a); },
        "The quaternion conjugate, real* + e dual*: conjugate(a b) = conjugate(b) conjugate(a).");
    def<DualQuat>(
        m, "dual_conjugate", {"a"}, [](const auto& a) { return dual_conjugate(a); },
        "The dual conjugate, real - e dual.");
    def<DualQuat>(
        m, "combined_conjugate", {"a"}, [](const auto& a) { return combined_conjugate(a); },
        R"(Both conjugates, real* - e dual*: a (1 + e p) combined_conjugate(a) = 1 + e p', with p' the image
of p.)");
    def<DualQuat>(
        m, "norm", {"a"}, [](const auto& a) { return norm(a); },
        "sqrt(a conjugate(a)), a dual number, [.., 2]: (1, 0) for a unit `a`; (0, 0) if the real part is 0.");
    def<DualQuat>(
        m, "log", {"a"}, [](const auto& a) { return log(a); },
        R"(The logarithm of unit `a`: half the twist, with scalar parts of 0 (Kavan et al. 2008, section 3.4). Of
a and -a, the one with w >= 0 is used.)");
    def<DualQuat>(
        m, "exp", {"a"}, [](const auto& a) { return exp(a); },
        "The unit dual quaternion whose logarithm is `a`, of any angle. Scalar parts are ignored.");
    def<DualQuat, Scalar>(
        m, "power", {"a", "exponent"}, [](const auto& a, auto exponent) { return power(a, exponent); },
        R"(The power of unit `a`: its screw with angle and translation multiplied by `exponent`, [..] (Kavan et
al. 2008, section 3.4).

It takes the shorter way: of a and -a, the one with w >= 0 is used.)");
}

void bind_dual_numbers(py::module_& m) {
    def<Dual, Dual>(
        m, "multiply", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; },
        "a b: (real a real b, real a dual b + dual a real b).");
    def<Dual, Dual>(
        m, "divide", {"a", "b"},
        [](const auto& a, const auto& b) {
            if (b.real == 0) fail("b", "dual numbers whose real part is not 0", "one of real part 0");
            return a / b;
        },
        "a / b. ValueError if a real part of `b` is 0: such a number has no inverse.");
    def<Dual>(
        m, "conjugate", {"a"}, [](const auto& a) { return conjugate(a); }, "The conjugate: real - e dual.");
    def<Dual>(
        m, "sin", {"a"}, [](const auto& a) { return sin(a); },
        "The sine, radians: for example of a screw's angle and length.");
    def<Dual>(
        m, "cos", {"a"}, [](const auto& a) { return cos(a); }, "The cosine, radians.");
    def<Dual>(
        m, "exp", {"a"}, [](const auto& a) { return exp(a); }, "The exponential.");
    const auto of_positive = [](auto f) {
        return [f](const auto& a) {
            if (!(a.real > 0)) fail("a", "dual numbers whose real part is above 0", "one that is not");
            return f(a);
        };
    };
    def<Dual>(
        m, "sqrt", {"a"}, of_positive([](const auto& a) { return sqrt(a); }),
        "The square root with a positive real part. ValueError if the real part of `a` is not positive.");
    def<Dual>(m, "log", {"a"}, of_positive([](const auto& a) { return log(a); }),
              "The natural logarithm. ValueError if the real part of `a` is not positive.");
}

void bind_quaternions(py::module_& m) {
    def<Vec3, Scalar>(
        m, "from_axis_angle", {"axis", "angle"},
        [](const auto& axis, auto angle) { return quat_from_axis_angle(axis, angle); },
        "The rotation by `angle` radians, [..], about `axis`, [.., 3], of any length; 0 gives the identity.");
    def<Vec3>(
        m, "from_rotation_vector", {"vector"},
        [](const auto& vector) { return quat_from_rotation_vector(vector); },
        "The rotation about `vector`, [.., 3], by its length in radians, of any size.");
    def<Quat>(
        m, "to_rotation_vector", {"q"}, [](const auto& q) { return rotation_vector(q); },
        R"(Axis times angle of unit `q`, [.., 3], with a length of 0 to pi; at pi the signs of `q` decide its
direction.)");
    def<Mat3>(
        m, "from_rotation_matrix", {"rotation"},
        []<class T>(const Mat3<T>& rotation) {
            check_rigid(Affine<T>{rotation, Vec3<T>(T(0))}, "rotation");
            return to_quat(rotation);
        },
        "The quaternion of a matrix, [.., 3, 3], with w >= 0. ValueError if it is no rotation.");
    def<Quat>(
        m, "to_rotation_matrix", {"q"}, [](const auto& q) { return to_mat3(q); },
        "The rotation matrix of unit `q`, [.., 3, 3].");
    def<Quat, Quat>(
        m, "compose", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; },
        "The product a b (Hamilton), which applies the rotation `b` first.");
    def<Quat>(
        m, "conjugate", {"q"}, [](const auto& q) { return glm::conjugate(q); },
        "The conjugate w - xi - yj - zk: the inverse of a unit quaternion.");
    def<Quat>(
        m, "norm", {"q"},
        []<class T>(const Quat<T>& q) {
            return norm(DualQuat<T>{q, q}).real;
        },
        "The length, [..].");
    def<Quat>(
        m, "normalized", {"q"},
        []<class T>(const Quat<T>& q) {
            return normalized(QuatVec<T>{q, Vec3<T>(T(0))}).rotation;
        },
        "`q` divided by its length; length 0 gives the identity.");
    def<Quat, Vec3>(
        m, "rotate", {"q", "vectors"}, [](const auto& q, const auto& v) { return rotate(q, v); },
        "q v q*: the images of `vectors`, [.., 3], under the rotation by unit `q`.");
    def<Quat, Quat>(
        m, "angle_between", {"a", "b"}, [](const auto& a, const auto& b) { return angle_between(a, b); },
        "The angle of the rotation from `a` to `b`, [..], 0 to pi; signs do not matter.");
    def<Quat, Quat, Scalar>(
        m, "slerp", {"a", "b", "t"},
        [](const auto& a, const auto& b, auto t) { return slerp(a, aligned(b, a), t); },
        R"(Interpolates from `a` at t = 0 to `b` at t = 1 at constant speed, along the shorter way (Shoemake
1985).

At 180 degrees the signs as given decide; sinew.interpolate.between with "qv_slerp" reports where that
happens.)");
    def<Quat>(
        m, "to_three_numbers", {"q"}, [](const auto& q) { return three_numbers(q); },
        "x, y and z of `q` or -q, whichever has w >= 0, [.., 3], for storage (Smith 2013, section 3.3).");
    def<Vec3>(
        m, "from_three_numbers", {"numbers"}, [](const auto& numbers) { return from_three_numbers(numbers); },
        R"(The inverse of to_three_numbers(): w is computed from the unit length.

Near 180 degrees w is small and imprecise: its error is up to the square root of the type's rounding error,
3e-4 for float32.)");
}

}  // namespace

void bind_transforms(py::module_& m) {
    auto affine = m.def_submodule("affine");
    auto quat_vec = m.def_submodule("quat_vec");
    auto dual_quat = m.def_submodule("dual_quat");
    bind_representation<Affine>(affine);
    bind_representation<QuatVec>(quat_vec);
    bind_representation<DualQuat>(dual_quat);
    def<Affine, Affine>(
        affine, "split_scale", {"posed_from_rest", "rest_bone"},
        [](const auto& posed_from_rest, const auto& rest_bone) {
            const auto split = split_scale(posed_from_rest, rest_bone);
            return named<"ScaleSplit">(split.rigid, split.scale, split.has_scale);
        },
        R"(Splits a bone's motion into posed_from_rest = rigid * scale, for methods that blend rigid motions.

posed_from_rest: maps points of the rest shape to the pose; may scale, shear and mirror.
rest_bone: the bone's rest axes (Y along the bone) and head in the same space; orthonormal.

Axes are made perpendicular while keeping Y, as Blender's Armature modifier does for Preserve Volume;
mirroring becomes part of `scale`. For a motion within 1e-5 of orthonormal and 1e-4 of unit size, `scale` is
the identity. `rigid` is a rotation and a translation even if axes vanish.)");
    bind_dual_quaternions(dual_quat);
    auto dual = m.def_submodule("dual");
    bind_dual_numbers(dual);
    auto quat = m.def_submodule("quat");
    bind_quaternions(quat);
}

}  // namespace sinew::bindings
