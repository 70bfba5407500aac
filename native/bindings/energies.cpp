#include "bindings/bindings.hpp"

#include <vector>

#include "elements/dispatch.hpp"
#include "elements/elastic_energy.hpp"
#include "elements/tet_geometry.hpp"
#include "energies/inertia.hpp"
#include "energies/viscosity.hpp"
#include "materials/owned_program.hpp"

namespace qlb {
namespace {

// The density of `material` at each F (count, 3, 3): fills energy (count), stress (count, 9), stiffness
// (count, 81).
void evaluate_density(const std::string& material, const Array<const double>& F, const Array<const double>& parameters,
                      bool project, const Array<double>& energy, const Array<double>& stress,
                      const Array<double>& stiffness, const std::string& simd_level,
                      std::shared_ptr<OwnedProgram> owned) {
  const MaterialKernels& kernels = find_kernels(material, simd_level);
  const auto count = static_cast<std::int64_t>(F.size()) / 9;
  const Program* program = owned ? &owned->view() : nullptr;
  const int width = parameter_count(kernels, program);
  sized(parameters, count * width, "parameters");
  sized(energy, count, "energy");
  sized(stress, 9 * count, "stress");
  sized(stiffness, 81 * count, "stiffness");
  std::vector<double> in(9 * kLanes), par(static_cast<std::size_t>(width) * kLanes), psi(kLanes), P(9 * kLanes),
      C(81 * kLanes);
  for (std::int64_t first = 0; first < count; first += kLanes) {
    const auto lanes = static_cast<int>(std::min<std::int64_t>(kLanes, count - first));
    for (int l = 0; l < kLanes; ++l) {
      const std::int64_t e = first + std::min(l, lanes - 1);
      for (int k = 0; k < 9; ++k) in[k * kLanes + l] = F.data()[9 * e + k];
      for (int k = 0; k < width; ++k) par[k * kLanes + l] = parameters.data()[width * e + k];
    }
    kernels.density(in.data(), par.data(), program, project, psi.data(), P.data(), C.data());
    for (int l = 0; l < lanes; ++l) {
      const std::int64_t e = first + l;
      energy.data()[e] = psi[l];
      for (int k = 0; k < 9; ++k) stress.data()[9 * e + k] = P[k * kLanes + l];
      for (int k = 0; k < 81; ++k) stiffness.data()[81 * e + k] = C[k * kLanes + l];
    }
  }
}

}  // namespace

void bind_energies(nb::module_& m) {
  nb::class_<TetBlocks>(m, "TetBlocks", "Linear tetrahedra laid out for SIMD and threads.")
      .def(
          "__init__",
          [](TetBlocks* self, const Array<const double>& rest, const Array<const std::int32_t>& tets,
             const BlockPattern& pattern) { new (self) TetBlocks(view(rest), view(tets), pattern); },
          nb::arg("rest_positions"), nb::arg("tets"), nb::arg("pattern"));

  nb::class_<TetGeometry>(m, "TetGeometry", "What a deformation is like, without any material.")
      .def(
          "__init__",
          [](TetGeometry* self, std::shared_ptr<TetBlocks> blocks, int threads) {
            new (self) TetGeometry(std::move(blocks), threads);
          },
          nb::arg("blocks"), nb::arg("threads"))
      .def(
          "least_J",
          [](TetGeometry& g, const Array<const double>& x) { return g.least_J(sized(x, 3 * g.nodes(), "x")); },
          nb::arg("x"), ReleaseGil())
      .def(
          "nodal_maps",
          [](TetGeometry& g, const Array<const double>& x, const Array<const double>& reference, double weight,
             const Array<double>& maps) {
            g.nodal_maps(sized(x, 3 * g.nodes(), "x"), sized(reference, 3 * g.nodes(), "reference"), weight,
                         sized(maps, 9 * g.nodes(), "maps"));
          },
          nb::arg("x"), nb::arg("reference"), nb::arg("weight"), nb::arg("maps").noconvert(), ReleaseGil());

  nb::class_<ElasticEnergy>(m, "ElasticEnergy")
      .def(
          "__init__",
          [](ElasticEnergy* self, std::shared_ptr<TetBlocks> blocks, const std::string& material,
             const Array<const double>& parameters, int threads, const std::string& simd_level,
             std::shared_ptr<OwnedProgram> program) {
            new (self)
                ElasticEnergy(std::move(blocks), material, view(parameters), threads, simd_level, std::move(program));
          },
          nb::arg("blocks"), nb::arg("material"), nb::arg("parameters"), nb::arg("threads"), nb::arg("simd_level") = "",
          nb::arg("program") = nb::none())
      .def(
          "value", [](ElasticEnergy& e, const Array<const double>& x) { return e.value(sized(x, 3 * e.nodes(), "x")); },
          nb::arg("x"), ReleaseGil())
      .def(
          "add_value_gradient",
          [](ElasticEnergy& e, const Array<const double>& x, double scale, const Array<double>& gradient) {
            return e.add_value_gradient(sized(x, 3 * e.nodes(), "x"), scale,
                                        sized(gradient, 3 * e.nodes(), "gradient"));
          },
          nb::arg("x"), nb::arg("scale"), nb::arg("gradient").noconvert(), ReleaseGil())
      .def(
          "add_viscous_value_gradient",
          [](ElasticEnergy& e, const Array<const double>& x, const ElasticEnergy& viscosity, double scale,
             const Array<double>& gradient) {
            return e.add_value_gradient(sized(x, 3 * e.nodes(), "x"), viscosity, scale,
                                        sized(gradient, 3 * e.nodes(), "gradient"));
          },
          nb::arg("x"), nb::arg("viscosity"), nb::arg("scale"), nb::arg("gradient").noconvert(), ReleaseGil(),
          "add_value_gradient of the sum of this and the viscosity of the same elements, in one loop over them.")
      .def(
          "add_hessian",
          [](ElasticEnergy& e, const Array<const double>& x, double scale, bool project, BlockMatrix& matrix) {
            e.add_hessian(sized(x, 3 * e.nodes(), "x"), scale, project, matrix);
          },
          nb::arg("x"), nb::arg("scale"), nb::arg("project"), nb::arg("matrix"), ReleaseGil());

  nb::class_<Viscosity, ElasticEnergy>(m, "Viscosity", "Kelvin-Voigt viscosity as a potential of one stage.")
      .def(
          "__init__",
          [](Viscosity* self, std::shared_ptr<TetBlocks> blocks, const Array<const double>& eta, int threads) {
            new (self) Viscosity(std::move(blocks), view(eta), threads);
          },
          nb::arg("blocks"), nb::arg("eta"), nb::arg("threads"))
      .def("clear_base", &Viscosity::clear_base, nb::arg("c"), ReleaseGil())
      .def(
          "add_base",
          [](Viscosity& e, double weight, const Array<const double>& x) {
            e.add_base(weight, sized(x, 3 * e.nodes(), "x"));
          },
          nb::arg("weight"), nb::arg("x"), ReleaseGil());

  nb::class_<Inertia>(m, "Inertia")
      .def(
          "__init__",
          [](Inertia* self, const Array<const std::int64_t>& row_begin, const Array<const std::int32_t>& columns,
             const Array<const double>& values, std::shared_ptr<BlockPattern> pattern, int threads) {
            new (self) Inertia(view(row_begin), view(columns), view(values), std::move(pattern), threads);
          },
          nb::arg("row_begin"), nb::arg("columns"), nb::arg("values"), nb::arg("pattern"), nb::arg("threads"))
      .def(
          "add_value_gradient",
          [](Inertia& e, const Array<const double>& x, const Array<const double>& target, double scale,
             const Array<double>& gradient) {
            if (x.size() != target.size() || x.size() != gradient.size())
              throw std::invalid_argument("x, target and gradient must have one shape");
            return e.add_value_gradient(x.data(), target.data(), scale, gradient.data());
          },
          nb::arg("x"), nb::arg("target"), nb::arg("scale"), nb::arg("gradient").noconvert(), ReleaseGil())
      .def("add_hessian", &Inertia::add_hessian, nb::arg("scale"), nb::arg("matrix"), ReleaseGil());

  m.def("evaluate_density", &evaluate_density, nb::arg("material"), nb::arg("F"), nb::arg("parameters"),
        nb::arg("project"), nb::arg("energy").noconvert(), nb::arg("stress").noconvert(),
        nb::arg("stiffness").noconvert(), nb::arg("simd_level") = "", nb::arg("program") = nb::none());
}

}  // namespace qlb
