// The tests of pairs at the SIMD level this file is compiled for (see CMakeLists.txt). Nothing here may use containers
// or other shared inline code: it would be compiled for that level too.
#include "contact/pair_kernels.hpp"

#include "contact/pair_planes.hpp"
#include "simd/lane_bits.hpp"

namespace qlb {
namespace {

using Floats = xsimd::batch<float, Arch>;
using Ints = xsimd::batch<std::int32_t, Arch>;
constexpr int kFloats = static_cast<int>(Floats::size);

// Bit j: box j meets the box lo, hi.
unsigned meets(const LeafBoxes& boxes, const float lo[3], const float hi[3]) {
  unsigned hits = 0;
  for (int j = 0; j < kLeaf; j += kFloats) {
    auto both = Floats(lo[0]) <= Floats::load_aligned(&boxes.hi[0][j]);
    both = both & (Floats::load_aligned(&boxes.lo[0][j]) <= Floats(hi[0]));
    for (int d = 1; d < 3; ++d) {
      both = both & (Floats(lo[d]) <= Floats::load_aligned(&boxes.hi[d][j]));
      both = both & (Floats::load_aligned(&boxes.lo[d][j]) <= Floats(hi[d]));
    }
    hits |= lane_bits(both) << j;
  }
  return hits;
}

unsigned overlaps(const LeafBoxes& a, const LeafBoxes& b, const float around[6], std::uint16_t hits[kLeaf]) {
  unsigned left = 0;
  for (unsigned near = meets(a, around, around + 3); near != 0; near &= near - 1) {
    const int i = __builtin_ctz(near);
    const float lo[3] = {a.lo[0][i], a.lo[1][i], a.lo[2][i]}, hi[3] = {a.hi[0][i], a.hi[1][i], a.hi[2][i]};
    const unsigned found = meets(b, lo, hi);
    hits[i] = static_cast<std::uint16_t>(found);
    left |= static_cast<unsigned>(found != 0) << i;
  }
  return left;
}

template <int corners_a, int corners_b>
unsigned drop_shared(const LeafNodes& a, const LeafNodes& b, unsigned which, std::uint16_t hits[kLeaf]) {
  unsigned left = 0;
  for (; which != 0; which &= which - 1) {
    const int i = __builtin_ctz(which);
    unsigned shared = 0;
    for (int j = 0; j < kLeaf; j += kFloats) {
      auto same = Ints(a.corner[0][i]) == Ints::load_aligned(&b.corner[0][j]);
      for (int k = 0; k < corners_a; ++k)
        for (int l = k == 0 ? 1 : 0; l < corners_b; ++l)
          same = same | (Ints(a.corner[k][i]) == Ints::load_aligned(&b.corner[l][j]));
      shared |= lane_bits(same) << j;
    }
    const unsigned found = hits[i] & ~shared;
    hits[i] = static_cast<std::uint16_t>(found);
    left |= static_cast<unsigned>(found != 0) << i;
  }
  return left;
}

constexpr PairKernels kKernels = {overlaps,
                                  {drop_shared<1, 3>, drop_shared<2, 2>, drop_shared<2, 3>},
                                  {planes::apart_in_boxes<Vec, 1>, planes::apart_in_boxes<Vec, 2>},
                                  {planes::apart_on_way<Vec, 1>, planes::apart_on_way<Vec, 2>}};

}  // namespace

#if defined(QLB_SIMD_AVX512)
const PairKernels& pair_kernels_AVX512() {
#elif defined(QLB_SIMD_AVX2)
const PairKernels& pair_kernels_AVX2() {
#elif defined(QLB_SIMD_NEON64)
const PairKernels& pair_kernels_NEON64() {
#else
const PairKernels& pair_kernels_SSE2() {
#endif
  return kKernels;
}

}  // namespace qlb
