// The SIMD level that this translation unit is compiled for, and its vector of doubles.
//
// Kernels are templates over the vector type V, whose type names the level. So the same template compiled
// for two levels gives two different functions, and the linker can never mix them up.
#pragma once

#include <xsimd/xsimd.hpp>

namespace qlb {

#if defined(QLB_SIMD_AVX512)
using Arch = xsimd::avx512f;
#elif defined(QLB_SIMD_AVX2)
using Arch = xsimd::fma3<xsimd::avx2>;
#elif defined(QLB_SIMD_NEON64)
using Arch = xsimd::neon64;
#else
using Arch = xsimd::sse2;
#endif

using Vec = xsimd::batch<double, Arch>;

}  // namespace qlb
