// Two unit vectors that make an orthonormal basis with a unit normal, always the same ones.
#pragma once

#include <array>
#include <cmath>

#include "contact/vec3.hpp"

namespace qlb {

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
inline std::array<Vec3, 2> tangents(Vec3 n) {
  const double sign = std::copysign(1.0, n.z), a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  return {{{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}}};
}

}  // namespace qlb
