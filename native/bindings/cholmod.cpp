#include <cblas.h>
#include <cholmod.h>

#include "bindings/bindings.hpp"
#include "linalg/cholmod_cholesky.hpp"

namespace qlb {

void bind_cholmod(nb::module_& m) {
  nb::class_<CholmodCholesky, Cholesky>(m, "CholmodCholesky")
      .def(
          "__init__",
          [](CholmodCholesky* self, std::shared_ptr<BlockPattern> pattern, const Array<const std::uint8_t>& fixed,
             int threads) { new (self) CholmodCholesky(std::move(pattern), view(fixed), threads); },
          nb::arg("pattern"), nb::arg("fixed"), nb::arg("threads"), ReleaseGil());

  int version[3];
  cholmod_l_version(version);
  m.attr("openblas_version") = openblas_get_config();
  m.attr("cholmod_version") =
      std::to_string(version[0]) + "." + std::to_string(version[1]) + "." + std::to_string(version[2]);
}

}  // namespace qlb
