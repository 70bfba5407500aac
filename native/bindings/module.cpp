#include "bindings/bindings.hpp"

#include <nanobind/stl/map.h>

#include <metis.h>

#include "elements/dispatch.hpp"

NB_MODULE(_native, m) {
  using namespace qlb;
  m.doc() = "Compiled kernels of qlb. Use the package `qlb`; this module has no stable interface.";
  bind_assembly(m);
  bind_terms(m);
  bind_contact(m);
  bind_barrier(m);
  bind_candidates(m);
  bind_program(m);
  bind_energies(m);
  bind_linalg(m);
  bind_low_rank(m);
  m.def("simd_levels", &simd_levels, "SIMD levels this build and this machine can run, the one in use last");
  m.def("material_names", &material_names);
  m.def("libraries", [] {
    std::map<std::string, std::string> versions;
    versions["METIS"] = std::to_string(METIS_VER_MAJOR) + "." + std::to_string(METIS_VER_MINOR) + "." +
                        std::to_string(METIS_VER_SUBMINOR);
    versions["compiler"] = __VERSION__;
    return versions;
  });
}
