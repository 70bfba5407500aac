// Instantiates every material's kernels at the SIMD level this file is compiled for (see CMakeLists.txt).
// Nothing here may use containers or other shared inline code: it would be compiled for that level too.
#include "elements/kernels.hpp"

#include "elements/element_loop.hpp"
#include "elements/geometry_kernels.hpp"
#include "materials/all.hpp"
#include "simd/arch.hpp"

namespace qlb {
namespace {

template <template <class> class... M>
const KernelSet& kernel_set(MaterialList<M...>) {
  static const MaterialKernels materials[] = {make_kernels<Vec, M>()..., MaterialKernels{}};
  static const KernelSet set = {materials, {chunk_least_J<Vec>, chunk_correlations<Vec>, nodal_maps<Vec>}};
  return set;
}

}  // namespace

#if defined(QLB_SIMD_AVX512)
const KernelSet& kernels_AVX512() {
  return kernel_set(AllMaterials{});
}
#elif defined(QLB_SIMD_AVX2)
const KernelSet& kernels_AVX2() {
  return kernel_set(AllMaterials{});
}
#elif defined(QLB_SIMD_NEON64)
const KernelSet& kernels_NEON64() {
  return kernel_set(AllMaterials{});
}
#else
const KernelSet& kernels_SSE2() {
  return kernel_set(AllMaterials{});
}
#endif

}  // namespace qlb
