// Instantiates every material's kernels at the SIMD level this file is compiled for (see CMakeLists.txt).
// Nothing here may use containers or other shared inline code: it would be compiled for that level too.
#include "elements/kernels.hpp"

#include "elements/element_loop.hpp"
#include "materials/all.hpp"
#include "simd/arch.hpp"

namespace qlb {
namespace {

template <template <class> class... M>
const MaterialKernels* kernel_table(MaterialList<M...>) {
  static const MaterialKernels table[] = {make_kernels<Vec, M>()..., MaterialKernels{}};
  return table;
}

}  // namespace

#if defined(QLB_SIMD_AVX512)
const MaterialKernels* kernels_AVX512() {
  return kernel_table(AllMaterials{});
}
#elif defined(QLB_SIMD_AVX2)
const MaterialKernels* kernels_AVX2() {
  return kernel_table(AllMaterials{});
}
#elif defined(QLB_SIMD_NEON64)
const MaterialKernels* kernels_NEON64() {
  return kernel_table(AllMaterials{});
}
#else
const MaterialKernels* kernels_SSE2() {
  return kernel_table(AllMaterials{});
}
#endif

}  // namespace qlb
