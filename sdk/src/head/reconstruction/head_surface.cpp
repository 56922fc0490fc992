#include "head/reconstruction/head_surface.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <vector>

#include "core/error.h"
#include "head/field/field_engine.h"
#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/mesh/mesh_simplify.h"

namespace maq::head {
namespace {

constexpr size_t kVerticesOfTask = 1024;
constexpr size_t kAnchorsOfLandmark = 4;  // as in the fit

// The field of one head together with its cut, for several threads at once.
class CutField {
 public:
  explicit CutField(const StoredHead& head) : cut_(head.cut), engine_(head.weights.shape()) {
    engine_.set_weights(head.weights);
  }

  void distances(const FieldPoints& points, float* values) const {
    const Lent lent(*this);
    engine_.distances(points, *lent.workspace, values);
    for (size_t i = 0; i < points.count; ++i) values[i] = std::max(values[i], cut_distance(points, i));
  }

  void gradients(const FieldPoints& points, const Planes& gradient) const {
    const Lent lent(*this);
    std::vector<float> values(points.count);
    engine_.distances(points, *lent.workspace, values.data(), gradient);
    for (size_t i = 0; i < points.count; ++i) {
      if (cut_distance(points, i) < values[i]) continue;
      gradient[0][i] = float(cut_.normal.x), gradient[1][i] = float(cut_.normal.y);
      gradient[2][i] = float(cut_.normal.z);
    }
  }

  void surface(const FieldPoints& points, const FieldValues& values) const {
    const Lent lent(*this);
    engine_.forward(points, *lent.workspace, values);
  }

 private:
  // A workspace for one call.
  struct Lent {
    explicit Lent(const CutField& of) : field(of) {
      std::lock_guard<std::mutex> lock(field.mutex_);
      if (field.idle_.empty()) {
        field.idle_.reserve(++field.made_);  // so that giving back takes no memory
        workspace = std::make_unique<FieldWorkspace>();
      } else {
        workspace = std::move(field.idle_.back());
        field.idle_.pop_back();
      }
    }
    ~Lent() {
      std::lock_guard<std::mutex> lock(field.mutex_);
      field.idle_.push_back(std::move(workspace));
    }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;

    const CutField& field;
    std::unique_ptr<FieldWorkspace> workspace;
  };

  float cut_distance(const FieldPoints& points, size_t i) const {
    return float(cut_.distance({double(points.x[i]), double(points.y[i]), double(points.z[i])}));
  }

  CutPlane cut_;
  FieldEngine engine_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<FieldWorkspace>> idle_;
  mutable size_t made_ = 0;
};

std::string names_of(const std::vector<NamedPoint>& landmarks) {
  std::string names;
  for (const NamedPoint& landmark : landmarks) names += (names.empty() ? "" : ", ") + landmark.name;
  return names.empty() ? "none" : names;
}

void set_surface_values(const CutField& field, HeadMesh& mesh, WorkerThreads& threads) {
  const size_t vertices = mesh.vertex_count();
  mesh.colours.resize(3 * vertices);
  mesh.template_points.resize(3 * vertices);
  threads.run((vertices + kVerticesOfTask - 1) / kVerticesOfTask, [&](size_t task, int) {
    const size_t begin = task * kVerticesOfTask, count = std::min(kVerticesOfTask, vertices - begin);
    std::vector<float> columns(9 * count);
    const auto column = [&](size_t index) { return &columns[index * count]; };
    for (size_t i = 0; i < count; ++i) {
      for (size_t axis = 0; axis < 3; ++axis) column(axis)[i] = mesh.positions[3 * (begin + i) + axis];
    }
    FieldValues values;
    values.rgb = {column(3), column(4), column(5)};
    values.template_point = {column(6), column(7), column(8)};
    field.surface({column(0), column(1), column(2), count}, values);
    for (size_t i = 0; i < count; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        mesh.colours[3 * (begin + i) + c] = byte_of_logit(column(3 + c)[i]);
        mesh.template_points[3 * (begin + i) + c] = column(6 + c)[i];
      }
    }
  });
}

}  // namespace

uint8_t byte_of_logit(float logit) {
  const double share = 1 / (1 + std::exp(-double(logit)));
  return share >= 0 ? uint8_t(std::lround(255 * share)) : uint8_t(0);
}

HeadLandmark landmark_by_anchors(const StoredAnchors& anchors, Vec3 template_point) {
  const size_t count = std::min<size_t>(kAnchorsOfLandmark, anchors.count());
  const auto point_of = [](const std::vector<float>& points, size_t i) {
    return Vec3{double(points[3 * i]), double(points[3 * i + 1]), double(points[3 * i + 2])};
  };
  std::vector<std::pair<double, size_t>> nearest(anchors.count());
  for (size_t i = 0; i < nearest.size(); ++i) {
    nearest[i] = {length(point_of(anchors.template_points, i) - template_point), i};
  }
  std::partial_sort(nearest.begin(), nearest.begin() + std::ptrdiff_t(count), nearest.end());
  HeadLandmark landmark{template_point};
  double sum = 0;
  Vec3 offset;
  for (size_t k = 0; k < count; ++k) {
    const auto [distance, i] = nearest[k];
    const double weight = 1 / std::max(distance * distance, 1e-12);
    sum += weight;
    offset = offset + weight * (point_of(anchors.points, i) - point_of(anchors.template_points, i));
    landmark.sigma += weight * double(anchors.sigma[i]);
  }
  if (count == 0) return landmark;
  landmark.point = template_point + (1 / sum) * offset;
  landmark.sigma /= sum;
  return landmark;
}

HeadLandmark find_head_landmark(const StoredHead& head, const std::string& name) {
  const auto found = std::find_if(head.landmarks.begin(), head.landmarks.end(),
                                  [&](const NamedPoint& landmark) { return landmark.name == name; });
  if (found == head.landmarks.end()) {
    throw Error(MAQ_ERROR_NOT_FOUND, "The head has no landmark named \"", name, "\"; it has ", names_of(head.landmarks),
                ".");
  }
  return landmark_by_anchors(head.anchors, {double(found->template_point[0]), double(found->template_point[1]),
                                            double(found->template_point[2])});
}

HeadMesh head_surface(const StoredHead& head, const SurfaceOptions& surface, WorkerThreads& threads,
                      SurfaceStats* stats) {
  const double cell_m = surface.cell_m != 0 ? surface.cell_m : default_surface_cell_m(surface.triangles);
  if (!(cell_m >= kMinSurfaceCell_m && cell_m <= kMaxSurfaceCell_m)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The cells of a head's mesh are ", cell_m, " m large, but must be ",
                kMinSurfaceCell_m, " to ", kMaxSurfaceCell_m, ".");
  }
  const CutField field(head);
  MarchingCubesOptions options;
  options.box_min = head.bounds.min;
  options.box_max = head.bounds.max;
  options.cell = float(cell_m / head.scale.metres_per_unit);
  HeadMesh mesh = marching_cubes(
      [&](const float* x, const float* y, const float* z, float* values, size_t count) {
        field.distances({x, y, z, count}, values);
      },
      options, threads);
  if (mesh.triangles.empty()) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The head has no surface within its domain, so it has no mesh. Fit it again, to a sharper photo.");
  }
  keep_largest_piece(mesh);
  SurfaceStats made;
  made.full_triangles = mesh.triangle_count();
  if (made.full_triangles > surface.triangles) {
    const std::vector<float> full = mesh.positions;
    simplify_mesh(mesh, surface.triangles);
    made.error_m = head.scale.metres_per_unit * largest_distance(full, mesh, threads);
  }
  if (stats != nullptr) *stats = made;
  set_normals(
      mesh,
      [&](const float* x, const float* y, const float* z, float* gx, float* gy, float* gz, size_t count) {
        field.gradients({x, y, z, count}, {gx, gy, gz});
      },
      threads);
  set_surface_values(field, mesh, threads);
  const float to_decimetres = float(10 * head.scale.metres_per_unit);
  for (float& value : mesh.positions) value *= to_decimetres;
  return mesh;
}

}  // namespace maq::head
