#include <stdexcept>

#include "linalg/dense_kernels.hpp"

namespace qlb {

template <class T>
const DenseKernels<T>& find_dense_kernels(const std::string& level) {
  std::vector<const DenseKernels<T>*> usable;
#ifdef QLB_HAS_SSE2
  usable.push_back(dense_kernels_SSE2<T>());
#endif
#ifdef QLB_HAS_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) usable.push_back(dense_kernels_AVX2<T>());
#endif
#ifdef QLB_HAS_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma")) usable.push_back(dense_kernels_AVX512<T>());
#endif
#ifdef QLB_HAS_NEON64
  usable.push_back(dense_kernels_NEON64<T>());
#endif
  if (level.empty()) return *usable.back();
  for (const DenseKernels<T>* kernels : usable)
    if (level == kernels->level) return *kernels;
  throw std::invalid_argument("SIMD level '" + level + "' is not available here");
}

template const DenseKernels<double>& find_dense_kernels(const std::string&);
template const DenseKernels<float>& find_dense_kernels(const std::string&);

}  // namespace qlb
