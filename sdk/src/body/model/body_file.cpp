#include "body/model/body_file.h"

#include <cmath>
#include <cstring>
#include <vector>

namespace maq::body {
namespace {

constexpr char kKind[] = "a body (.maqb)";
constexpr char kRemedy[] = "Export the bundle again, or use the Maquette that it was made for.";
constexpr size_t kMaxVertices = 20'000, kMaxTriangles = 40'000, kMaxNodes = 64;
constexpr int kWhole = 255;

template <class Stored>
std::vector<Stored> stored(CheckedBytes& file, size_t count) {
  const std::vector<uint8_t> bytes = file.bytes(count * sizeof(Stored));
  std::vector<Stored> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

Vec3 vector_at(const std::vector<int16_t>& values, size_t index, double step) {
  const int16_t* const from = values.data() + 3 * index;
  return {step * from[0], step * from[1], step * from[2]};
}

void check_head(const BodyFileHead& head, const CheckedBytes& file) {
  file.size_within(head.joints, kMaxJoints, "joints");
  if (head.shapes > kMaxShapes) file.fail(" has ", head.shapes, " shapes; at most ", kMaxShapes, " are allowed.");
  file.size_within(head.vertices, kMaxVertices, "vertices");
  file.size_within(head.triangles, kMaxTriangles, "triangles");
  file.size_within(head.surface_nodes, kMaxNodes, "nodes of its surface a side");
  if (head.surface_nodes < 2) file.fail(" has a surface of one node a side; 2 or more are needed.");
  if (head.keypoints != kKeypoints) file.fail(" has ", head.keypoints, " keypoints, but must have ", kKeypoints, ".");
  if (!(head.point_step_m >= 1e-6f && head.point_step_m <= 1e-3f)) {
    file.fail(" stores its points in steps of ", head.point_step_m, " m, but they must be 1e-6 to 0.001.");
  }
}

void read_joints(CheckedBytes& file, const BodyFileHead& head, const std::vector<float>& steps, BodyModel& model) {
  model.joints.resize(head.joints);
  for (BodyJoint& joint : model.joints) {
    const std::vector<uint8_t> text = file.bytes(file.number<uint8_t>());
    joint.name.assign(text.begin(), text.end());
    joint.parent = int{file.number<int8_t>()};  // NOLINT(bugprone-signed-char-misuse): -1 is no parent
  }
  const auto rest = stored<int16_t>(file, 3 * size_t(head.joints));
  const auto basis = stored<int16_t>(file, 3 * size_t(head.joints) * head.shapes);
  for (size_t j = 0; j < head.joints; ++j) {
    model.joints[j].rest = vector_at(rest, j, double(head.point_step_m));
    for (size_t s = 0; s < head.shapes; ++s) {
      model.joints[j].basis[s] = vector_at(basis, s * head.joints + j, double(steps[s]));
    }
  }
}

void read_points(CheckedBytes& file, const BodyFileHead& head, const std::vector<float>& steps, BodyModel& model) {
  const size_t count = size_t(head.vertices) + head.keypoints;
  const auto rest = stored<int16_t>(file, 3 * count), basis = stored<int16_t>(file, 3 * count * head.shapes);
  const auto joints = stored<uint8_t>(file, kWeights * count), weights = stored<uint8_t>(file, kWeights * count);
  model.vertices.resize(head.vertices);
  for (size_t i = 0; i < count; ++i) {
    BodyPoint& point = i < head.vertices ? model.vertices[i] : model.keypoints[i - head.vertices];
    point.rest = vector_at(rest, i, double(head.point_step_m));
    for (size_t s = 0; s < head.shapes; ++s) point.basis[s] = vector_at(basis, s * count + i, double(steps[s]));
    int sum = 0;
    for (size_t k = 0; k < kWeights; ++k) {
      point.joints[k] = joints[kWeights * i + k];
      point.weights[k] = double(weights[kWeights * i + k]) / kWhole;
      sum += weights[kWeights * i + k];
    }
    if (sum != kWhole) file.fail(" has a point whose weights sum to ", sum, ", not ", kWhole, ".");
  }
}

void read_surface(CheckedBytes& file, const BodyFileHead& head, BodyModel& model) {
  const size_t count = kParts * size_t(head.surface_nodes) * head.surface_nodes;
  const auto triangles = stored<uint16_t>(file, count);
  const auto fractions = stored<uint8_t>(file, 2 * count);
  model.surface_nodes = int(head.surface_nodes);
  model.surface.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const double a = double(fractions[2 * i]) / kWhole, b = double(fractions[2 * i + 1]) / kWhole;
    model.surface[i] = {triangles[i], {a, b, 1 - a - b}};
  }
}

}  // namespace

BodyModel read_body(const void* bytes, size_t count, const std::string& name) {
  if (count > kMaxBodyFileBytes) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name, " has ", count, " bytes; a body has at most ", kMaxBodyFileBytes, ".");
  }
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<BodyFileHead>(kBodyFileMagic, kBodyFileVersion, kKind, kRemedy);
  check_head(head, file);
  BodyModel model;
  model.shape_count = head.shapes;
  const std::vector<float> steps = file.floats(head.shapes);
  read_joints(file, head, steps, model);
  read_points(file, head, steps, model);
  for (const uint16_t vertex : stored<uint16_t>(file, 3 * size_t(head.triangles))) model.triangles.push_back(vertex);
  read_surface(file, head, model);
  const size_t angles = model.angle_count();
  for (auto* values : {&model.prior.mean, &model.prior.low, &model.prior.high}) {
    const std::vector<float> read = file.floats(angles);
    values->assign(read.begin(), read.end());
  }
  const std::vector<float> precision = file.floats(angles * angles);
  model.prior.precision.assign(precision.begin(), precision.end());
  file.end();
  if (const std::string fault = model_fault(model); !fault.empty()) {
    file.fail(" cannot be used: ", fault, ". Export the bundle again.");
  }
  return model;
}

std::shared_ptr<const BodyModel> model_of_bundle(const Bundle& bundle) {
  bundle.manifest.require_task("body");
  const std::string name = bundle.manifest.listed_file(bundle.manifest.root.at("body").at("file"));
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  return std::make_shared<const BodyModel>(read_body(bytes.data(), bytes.size(), bundle.path_of(name)));
}

}  // namespace maq::body
