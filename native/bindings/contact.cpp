#include "bindings/bindings.hpp"
#include "bindings/rows.hpp"
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
}

}  // namespace qlb
