// Bit k of an integer: lane k of a vector of truth values. xsimd has this as mask() from version 9 on.
#pragma once

#include "simd/arch.hpp"

namespace qlb {

template <class T>
unsigned lane_bits(const xsimd::batch_bool<T, Arch>& lanes) {
  if constexpr (requires { lanes.mask(); }) {
    return static_cast<unsigned>(lanes.mask());
  } else {
#if defined(QLB_SIMD_AVX512)
    return static_cast<unsigned>(lanes.data);
#else
    alignas(64) bool truth[xsimd::batch_bool<T, Arch>::size];
    lanes.store_aligned(truth);
    unsigned bits = 0;
    for (unsigned k = 0; k < xsimd::batch_bool<T, Arch>::size; ++k) bits |= static_cast<unsigned>(truth[k]) << k;
    return bits;
#endif
  }
}

#if defined(QLB_SIMD_AVX2)
inline unsigned lane_bits(const xsimd::batch_bool<double, Arch>& lanes) {
  return static_cast<unsigned>(_mm256_movemask_pd(lanes.data));
}
inline unsigned lane_bits(const xsimd::batch_bool<float, Arch>& lanes) {
  return static_cast<unsigned>(_mm256_movemask_ps(lanes.data));
}
inline unsigned lane_bits(const xsimd::batch_bool<std::int32_t, Arch>& lanes) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(lanes.data)));
}
#elif defined(QLB_SIMD_SSE2)
inline unsigned lane_bits(const xsimd::batch_bool<double, Arch>& lanes) {
  return static_cast<unsigned>(_mm_movemask_pd(lanes.data));
}
inline unsigned lane_bits(const xsimd::batch_bool<float, Arch>& lanes) {
  return static_cast<unsigned>(_mm_movemask_ps(lanes.data));
}
inline unsigned lane_bits(const xsimd::batch_bool<std::int32_t, Arch>& lanes) {
  return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(lanes.data)));
}
#endif

}  // namespace qlb
