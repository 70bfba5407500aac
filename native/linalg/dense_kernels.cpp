// The dense kernels at the SIMD level this file is compiled for (see CMakeLists.txt). Nothing here may use containers
// or other shared inline code: it would be compiled for that level too.
#include "linalg/dense_kernels.hpp"

#include "linalg/dense_columns.hpp"
#include "linalg/dense_compact.hpp"
#include "linalg/dense_front.hpp"
#include "linalg/dense_solve.hpp"
#include "linalg/dense_terms.hpp"
#include "linalg/dense_vectors.hpp"
#include "simd/arch.hpp"

namespace qlb {
namespace {

template <class T>
const CompactKernels* make_compact_kernels() {
  if constexpr (std::is_same_v<T, float>) {
    using V = xsimd::batch<float, Arch>;
    static const CompactKernels kernels = {dense::compact_pack<V>, dense::compact_forward_own<V>,
                                           dense::compact_forward_below<V>, dense::compact_backward_above<V>,
                                           dense::compact_backward_own<V>};
    return &kernels;
  } else {
    return nullptr;
  }
}

template <class T>
const DenseKernels<T>* make_dense_kernels(const char* level) {
  using V = xsimd::batch<T, Arch>;
  static const DenseKernels<T> kernels = {level,
                                          dense::factor<V, T>,
                                          dense::solve_rows<V, T>,
                                          dense::subtract<V, T>,
                                          dense::extend_add<V, T>,
                                          dense::forward_own<V, T>,
                                          dense::forward_below<V, T>,
                                          dense::backward_above<V, T>,
                                          dense::backward_own<V, T>,
                                          dense::gram3<V, T>,
                                          dense::dots3<V, T>,
                                          dense::subtract3<V, T>,
                                          dense::multiply_terms<V, T>,
                                          dense::dot_terms<V, T>,
                                          dense::dot<V, T>,
                                          dense::add_scaled<V, T>,
                                          make_compact_kernels<T>()};
  return &kernels;
}

}  // namespace

#if defined(QLB_SIMD_AVX512)
#define QLB_DENSE_KERNELS dense_kernels_AVX512
constexpr const char* kLevel = "avx512";
#elif defined(QLB_SIMD_AVX2)
#define QLB_DENSE_KERNELS dense_kernels_AVX2
constexpr const char* kLevel = "avx2";
#elif defined(QLB_SIMD_NEON64)
#define QLB_DENSE_KERNELS dense_kernels_NEON64
constexpr const char* kLevel = "neon64";
#else
#define QLB_DENSE_KERNELS dense_kernels_SSE2
constexpr const char* kLevel = "sse2";
#endif

template <>
const DenseKernels<double>* QLB_DENSE_KERNELS<double>() {
  return make_dense_kernels<double>(kLevel);
}
template <>
const DenseKernels<float>* QLB_DENSE_KERNELS<float>() {
  return make_dense_kernels<float>(kLevel);
}

}  // namespace qlb
