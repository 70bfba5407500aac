// How far a step may go towards planes.
#pragma once

#include <cstdint>
#include <span>

namespace qlb {

// The planes n.x = offset, and which of the vertices they hold out.
struct PlaneGaps {
  std::span<const std::int32_t> vertices;  // nodes (v)
  std::span<const double> normals;         // (q, 3), of unit length
  std::span<const double> offsets;         // (q)
  std::span<const std::uint8_t> near;      // (v, q)
};

struct PlaneBound {
  double part = 1.0;  // of the step
  std::int32_t node = -1, plane = -1;
};

// The largest part of a step p from x, at most 1, that takes no more than `share` of any gap; the planes' offsets grow
// by `motion` (q) at the same time. 0 where there is no gap at x.
PlaneBound plane_bound(const PlaneGaps& planes, const double* x, const double* p, std::span<const double> motion,
                       double share);

}  // namespace qlb
