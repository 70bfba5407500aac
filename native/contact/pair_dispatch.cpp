#include "contact/pair_kernels.hpp"

namespace qlb {
namespace {

const PairKernels& best_kernels() {
#ifdef QLB_HAS_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma")) return pair_kernels_AVX512();
#endif
#ifdef QLB_HAS_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return pair_kernels_AVX2();
#endif
#ifdef QLB_HAS_NEON64
  return pair_kernels_NEON64();
#else
  return pair_kernels_SSE2();
#endif
}

}  // namespace

const PairKernels& pair_kernels() {
  static const PairKernels& best = best_kernels();
  return best;
}

}  // namespace qlb
