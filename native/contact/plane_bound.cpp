#include "contact/plane_bound.hpp"

#include <algorithm>

#include "contact/vec3.hpp"

namespace qlb {

PlaneBound plane_bound(const PlaneGaps& planes, const double* x, const double* p, std::span<const double> motion,
                       double share) {
  PlaneBound bound;
  const std::size_t count = planes.offsets.size();
  for (std::size_t q = 0; q < count; ++q) {
    const Vec3 normal = load3(&planes.normals[3 * q]);
    for (std::size_t v = 0; v < planes.vertices.size(); ++v) {
      if (!planes.near[v * count + q]) continue;
      const std::int64_t at = 3 * static_cast<std::int64_t>(planes.vertices[v]);
      const double most = share * (dot(normal, load3(x + at)) - planes.offsets[q]);
      const double closing = motion[q] - dot(normal, load3(p + at));
      if (closing > most && most < bound.part * closing)
        bound = {std::max(0.0, most / closing), planes.vertices[v], static_cast<std::int32_t>(q)};
    }
  }
  return bound;
}

}  // namespace qlb
