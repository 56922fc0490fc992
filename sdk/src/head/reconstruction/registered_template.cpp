#include "head/reconstruction/registered_template.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "head/field/field_engine.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/reconstruction/head_surface.h"
#include "head/registration/template_joints.h"
#include "head/registration/visemes.h"

namespace maq::head {
namespace {

constexpr size_t kPointsOfTask = 512;

using Rgb = std::array<uint8_t, 3>;

// Colours of parts that no photo shows.
std::optional<Rgb> colour_of(TemplateKind kind) {
  switch (kind) {
    case TemplateKind::kMouth: return Rgb{120, 62, 60};
    case TemplateKind::kEye: return Rgb{225, 222, 218};
    case TemplateKind::kTeeth: return Rgb{226, 218, 202};
    case TemplateKind::kTongue: return Rgb{164, 88, 86};
    default: return std::nullopt;
  }
}

// The value of each vertex's point, `each` numbers.
template <class T>
std::vector<T> by_vertex(const HeadTemplate& onto, const std::vector<T>& of_points, size_t each) {
  std::vector<T> made;
  made.reserve(each * onto.vertex_points.size());
  for (const uint32_t point : onto.vertex_points) {
    made.insert(made.end(), of_points.begin() + std::ptrdiff_t(each * point),
                of_points.begin() + std::ptrdiff_t(each * (point + 1)));
  }
  return made;
}

MorphTarget morph_target(const HeadTemplate& onto, const FacialAction& action, double scale) {
  MorphTarget made;
  made.name = action.name;
  std::vector<uint32_t> order(onto.point_count());  // one more than the place in the action; 0: does not move
  for (size_t k = 0; k < action.points.size(); ++k) order[action.points[k]] = uint32_t(k + 1);
  for (size_t vertex = 0; vertex < onto.vertex_points.size(); ++vertex) {
    const size_t k = order[onto.vertex_points[vertex]];
    if (k == 0) continue;
    made.vertices.push_back(uint32_t(vertex));
    for (size_t axis = 0; axis < 3; ++axis) {
      made.deltas.push_back(float(scale * double(action.deltas[3 * (k - 1) + axis])));
    }
  }
  return made;
}

void set_joints(const TemplateJoints& joints, const HeadTemplate& onto, double to_decimetres, HeadMesh& mesh) {
  for (const TemplateJoint& joint : joints.joints) {
    const Vec3 p = to_decimetres * joint.position;
    mesh.joints.push_back({joint.name, joint.parent, {float(p.x), float(p.y), float(p.z)}});
  }
  for (const uint32_t point : onto.vertex_points) {
    VertexJoints made{};
    size_t used = 0;
    for (size_t joint = 0; joint < joints.joints.size(); ++joint) {
      const float weight = joints.weights[point][joint];
      if (weight > 0) made.joints[used] = uint8_t(joint), made.weights[used++] = weight;
    }
    mesh.vertex_joints.push_back(made);
  }
}

}  // namespace

HeadMesh registered_template(const StoredHead& head, const HeadTemplate& onto, WorkerThreads& threads,
                             TemplateRegistration* registration) {
  FieldEngine engine(head.weights.shape());
  engine.set_weights(head.weights);
  std::vector<FieldWorkspace> workspaces(size_t(threads.count()));
  const auto field = [&](const float* x, const float* y, const float* z, float* values, size_t count) {
    threads.run((count + kPointsOfTask - 1) / kPointsOfTask, [&](size_t task, int worker) {
      const size_t begin = task * kPointsOfTask, size = std::min(kPointsOfTask, count - begin);
      const auto plane = [&](size_t index) { return values + index * count + begin; };
      FieldValues wanted;
      wanted.distance = plane(0);
      wanted.normal = {plane(1), plane(2), plane(3)};
      wanted.template_point = {plane(4), plane(5), plane(6)};
      wanted.rgb = {plane(7), plane(8), plane(9)};
      engine.forward({x + begin, y + begin, z + begin, size}, workspaces[size_t(worker)], wanted);
    });
  };
  std::vector<float> starts;
  for (size_t i = 0; i < onto.points.size(); i += 3) {
    const Vec3 point = landmark_by_anchors(head.anchors, {double(onto.points[i]), double(onto.points[i + 1]),
                                                          double(onto.points[i + 2])})
                           .point;
    for (const double value : {point.x, point.y, point.z}) starts.push_back(float(value));
  }
  TemplateRegistration registered = register_template(onto, starts, field);

  HeadMesh of_points;
  of_points.positions = registered.points;
  of_points.colours.resize(registered.points.size());
  for (size_t i = 0; i < onto.point_count(); ++i) {
    const std::optional<Rgb> fixed = colour_of(onto.kinds[i]);
    for (size_t c = 0; c < 3; ++c) {
      of_points.colours[3 * i + c] = fixed ? (*fixed)[c] : byte_of_logit(registered.colours[3 * i + c]);
    }
  }
  for (const uint32_t corner : onto.triangles) of_points.triangles.push_back(onto.vertex_points[corner]);
  set_normals(of_points);

  const double to_decimetres = 10 * head.scale.metres_per_unit;
  HeadMesh mesh;
  mesh.positions = by_vertex(onto, of_points.positions, 3);
  for (float& value : mesh.positions) value *= float(to_decimetres);
  mesh.normals = by_vertex(onto, of_points.normals, 3);
  mesh.colours = by_vertex(onto, of_points.colours, 3);
  mesh.template_points = by_vertex(onto, onto.points, 3);
  mesh.texture_coordinates = onto.texture_coordinates;
  mesh.triangles = onto.triangles;
  for (const FacialAction& action : onto.actions) {
    mesh.morph_targets.push_back(morph_target(onto, action, registered.scale * to_decimetres));
  }
  for (const FacialAction& viseme : visemes_of(onto)) {
    mesh.morph_targets.push_back(morph_target(onto, viseme, registered.scale * to_decimetres));
  }
  set_joints(template_joints(onto, registered), onto, to_decimetres, mesh);
  if (registration != nullptr) *registration = std::move(registered);
  return mesh;
}

}  // namespace maq::head
