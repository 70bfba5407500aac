// Bit k of an integer: lane k of a vector of truth values. xsimd has this as mask() from version 9 on.
#pragma once

#include "simd/arch.hpp"

namespace qlb {

template <class T>
unsigned lane_bits(const xsimd::batch_bool<T, Arch>& lanes) {
  if constexpr (requires { lanes.mask(); }) return static_cast<unsigned>(lanes.mask());
#if defined(QLB_SIMD_AVX512)
  else
    return static_cast<unsigned>(lanes.data);
#elif defined(QLB_SIMD_AVX2)
  else if constexpr (sizeof(T) == 8)
    return static_cast<unsigned>(_mm256_movemask_pd((__m256d)lanes.data));
  else
    return static_cast<unsigned>(_mm256_movemask_ps((__m256)lanes.data));
#elif defined(QLB_SIMD_SSE2)
  else if constexpr (sizeof(T) == 8)
    return static_cast<unsigned>(_mm_movemask_pd((__m128d)lanes.data));
  else
    return static_cast<unsigned>(_mm_movemask_ps((__m128)lanes.data));
#else
  alignas(64) bool truth[xsimd::batch_bool<T, Arch>::size];
  lanes.store_aligned(truth);
  unsigned bits = 0;
  for (unsigned k = 0; k < xsimd::batch_bool<T, Arch>::size; ++k) bits |= static_cast<unsigned>(truth[k]) << k;
  return bits;
#endif
}

}  // namespace qlb
