#include <nanobind/stl/tuple.h>

#include "bindings/bindings.hpp"
#include "bindings/rows.hpp"
#include "contact/plane_bound.hpp"
#include "contact/surface.hpp"

namespace qlb {
namespace {

void bind_surface(nb::module_& m) {
  nb::class_<ContactSurface>(m, "ContactSurface", "The triangles that may touch, and which bodies may touch which.")
      .def(
          "__init__",
          [](ContactSurface* self, const Array<const double>& rest, const Array<const std::int32_t>& faces,
             const Array<const std::int32_t>& group, const Array<const std::uint8_t>& allowed) {
            new (self) ContactSurface(view(rest), view(faces), view(group), view(allowed));
          },
          nb::arg("rest"), nb::arg("faces"), nb::arg("group"), nb::arg("allowed"))
      .def_prop_ro(
          "faces", [](const ContactSurface& s) { return rows(s.faces()); }, nb::rv_policy::reference_internal)
      .def_prop_ro(
          "edges", [](const ContactSurface& s) { return rows(s.edges()); }, nb::rv_policy::reference_internal)
      .def_prop_ro(
          "vertices", [](const ContactSurface& s) { return entries(s.vertices()); }, nb::rv_policy::reference_internal)
      .def("node_area", &ContactSurface::node_area, nb::arg("node"))
      .def("edge_area", &ContactSurface::edge_area, nb::arg("edge"));
}

}  // namespace

void bind_contact(nb::module_& m) {
  bind_surface(m);
  m.def(
      "plane_bound",
      [](const Array<const std::int32_t>& vertices, const Array<const double>& normals,
         const Array<const double>& offsets, const Array<const std::uint8_t>& near, const Array<const double>& x,
         const Array<const double>& p, const Array<const double>& motion, double share) {
        const auto planes = static_cast<std::int64_t>(offsets.size());
        sized(normals, 3 * planes, "normals");
        sized(motion, planes, "motion");
        sized(near, static_cast<std::int64_t>(vertices.size()) * planes, "near");
        for (const std::int32_t node : view(vertices))
          if (node < 0 || 3 * static_cast<std::int64_t>(node) + 2 >= static_cast<std::int64_t>(x.size()))
            throw std::invalid_argument("vertices name node " + std::to_string(node) + ", which x has not");
        const PlaneBound bound = plane_bound({view(vertices), view(normals), view(offsets), view(near)}, x.data(),
                                             sized(p, x.size(), "p"), view(motion), share);
        return std::tuple(bound.part, bound.node, bound.plane);
      },
      nb::arg("vertices"), nb::arg("normals"), nb::arg("offsets"), nb::arg("near"), nb::arg("x"), nb::arg("p"),
      nb::arg("motion"), nb::arg("share"), ReleaseGil(),
      "The largest part of a step p (n, 3) [m] from x, at most 1, that takes no more than `share` of any gap between "
      "vertices (v) and planes, normals (q, 3), offsets (q), that hold them out (near (v, q)) and whose offsets grow "
      "by motion (q) [m] at the same time; and the node and the plane that bound it, -1 where none does.");
}

}  // namespace qlb
