#include "scene/capture/capture.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/files/file.h"
#include "image/files/depth_file.h"
#include "image/files/image_file.h"
#include "image/geometry/undistort.h"
#include "scene/capture/colmap_model.h"
#include "scene/capture/ply_reader.h"
#include "scene/capture/posed_photo.h"
#include "scene/capture/scene_up.h"
#include "scene/capture/transforms_file.h"

namespace maq {
namespace {

template <size_t count>
std::string first_file(const std::string& folder, const char* const (&names)[count]) {
  for (const char* name : names) {
    if (file_exists(folder + "/" + name)) return folder + "/" + name;
  }
  return "";
}

// Where most of the programs that make COLMAP models have the photos; the first folder that has one of them.
std::string folder_of_photos(const std::string& folder, const std::vector<PosedPhoto>& photos) {
  for (const char* name : {"images", "photos", "rgb", "input", "."}) {
    const std::string candidate = folder + "/" + name;
    for (const PosedPhoto& photo : photos) {
      if (stays_inside(photo.name) && file_exists(candidate + "/" + photo.name)) return candidate;
    }
  }
  return folder + "/images";
}

PinholeCamera camera_of(const Lens& undistorted, const PosedPhoto& photo) {
  PinholeCamera camera;
  camera.intrinsics() = undistorted.intrinsics();
  camera.rotation = photo.rotation;
  camera.centre = photo.centre;
  make_exact_rotation(camera.rotation);
  return camera;
}

// Makes views of photos, one after the other, or drops them.
class ViewMaker {
 public:
  ViewMaker(std::string folder, ImportReport& report) : folder_(std::move(folder)), report_(report) {}

  void add(const PosedPhoto& photo) {
    if (const char* reason = try_to_add(photo)) report_.add(reason, photo.name);
  }

  std::vector<CaptureView> views;

 private:
  // The reason why it was dropped; null when it was not.
  const char* try_to_add(const PosedPhoto& photo) {
    if (!stays_inside(photo.name)) return kPhotosOutside;
    if (!names_.insert(photo.name).second) return "photos that are named twice";
    if (const char* reason = fault_of(photo.lens)) return reason;
    if (const char* reason = fault_of_pose(photo)) return reason;
    CaptureView view{photo.name, folder_ + "/" + photo.name, {}, {}, photo.is_held_out, "", 0};
    try {
      const SizePx size = read_image_file_size(view.image_path);
      check_image_size(size.width, size.height, view.image_path);
      const double across = double(size.width) / photo.lens.width_px, down = double(size.height) / photo.lens.height_px;
      constexpr double kTolerance = 0.01;
      if (std::abs(across - down) > kTolerance * std::max(across, down)) {
        return "photos of another shape than their camera";
      }
      view.lens = resized(photo.lens, int(size.width), int(size.height));
    } catch (const Error& error) {
      if (error.status() == MAQ_ERROR_NOT_FOUND) return kPhotosMissing;
      if (error.status() == MAQ_ERROR_UNREADABLE || error.status() == MAQ_ERROR_UNSUPPORTED) return kPhotosUnreadable;
      if (error.status() == MAQ_ERROR_IMAGE_SIZE) return "photos without pixels, or over the limit of size";
      throw;
    }
    if (!made_ || !(view.lens == last_lens_)) {
      last_lens_ = view.lens;
      made_ = true;
      undistorted_ = without_distortion(view.lens);
    }
    if (!undistorted_) return "photos whose distortion is not invertible, or whose axis is outside of them";
    view.camera = camera_of(*undistorted_, photo);
    add_depth(photo, view);
    views.push_back(std::move(view));
    return nullptr;
  }

  // A photo without its depth is one all the same.
  void add_depth(const PosedPhoto& photo, CaptureView& view) {
    if (photo.depth_name.empty()) return;
    const std::string path = folder_ + "/" + photo.depth_name;
    if (!stays_inside(photo.depth_name)) {
      report_.add(kDepthOutside, photo.depth_name);
    } else if (!file_exists(path)) {
      report_.add(kDepthMissing, photo.depth_name);
    } else {
      view.depth_path = path;
      view.depth_unit_m = photo.depth_unit_m;
    }
  }

  std::string folder_;
  ImportReport& report_;
  std::set<std::string> names_;
  // Many photos are of one camera.
  bool made_ = false;
  Lens last_lens_;
  std::optional<Lens> undistorted_;
};

std::string text_of(const ImportReport& report) {
  const std::string text = describe(report.list());
  return text.empty() ? "there are none" : text;
}

std::vector<CaptureView> views_of(const std::string& folder, const std::vector<PosedPhoto>& photos,
                                  const std::string& capture, ImportReport& report) {
  ViewMaker maker(folder, report);
  for (const PosedPhoto& photo : photos) maker.add(photo);
  if (maker.views.empty()) {
    throw Error(MAQ_ERROR_UNREADABLE, capture, " has no photo that can be used: ", text_of(report), ".");
  }
  return std::move(maker.views);
}

std::vector<std::array<double, 9>> rotations_of(const std::vector<CaptureView>& views) {
  std::vector<std::array<double, 9>> rotations;
  for (const CaptureView& view : views) rotations.push_back(view.camera.rotation);
  return rotations;
}

// The medians of the cameras' coordinates, so that points that they see are near, whatever a stray camera or point
// does.
std::array<double, 3> middle_of(const std::vector<CaptureView>& views) {
  std::array<double, 3> middle{};
  for (size_t i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const CaptureView& view : views) values.push_back(view.camera.centre[i]);
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
    middle[i] = values[values.size() / 2];
  }
  return middle;
}

bool has_depth(const Capture& capture) {
  return std::any_of(capture.views.begin(), capture.views.end(),
                     [](const CaptureView& view) { return !view.depth_path.empty(); });
}

Capture open_colmap(const std::string& folder, const ColmapFiles& files) {
  ImportReport report;
  Capture capture;
  const std::vector<PosedPhoto> photos = read_colmap_photos(files, report);
  capture.views = views_of(folder_of_photos(folder, photos), photos, folder, report);
  capture.up = up_of_cameras(rotations_of(capture.views));
  const std::string dense = folder + "/fused.ply";
  capture.is_sparse = !file_exists(dense);
  capture.cloud = capture.is_sparse ? read_colmap_points(files, middle_of(capture.views), report)
                                    : read_ply_file(dense, middle_of(capture.views), report);
  capture.dropped = report.list();
  return capture;
}

Capture open_transforms(const std::string& folder, const std::string& file_name) {
  ImportReport report;
  Capture capture;
  const TransformsFile file = read_transforms_file(folder, file_name, report);
  std::string cloud;
  if (!file.cloud.empty()) {
    if (!stays_inside(file.cloud)) {
      throw Error(MAQ_ERROR_UNREADABLE, folder, "/", file_name, ": the \"ply_file_path\" ", file.cloud.substr(0, 200),
                  " leads out of its folder, where nothing is read; copy the cloud there.");
    }
    cloud = folder + "/" + file.cloud;
  } else {
    cloud = first_file(folder, {"sparse_pc.ply", "points3d.ply", "points3D.ply", "pointcloud.ply", "cloud.ply"});
  }
  capture.views = views_of(folder, file.photos, folder, report);
  if (cloud.empty() && !has_depth(capture)) {
    throw Error(
        MAQ_ERROR_NOT_FOUND, folder, "/", file_name,
        " names no point cloud (\"ply_file_path\"), and there is no sparse_pc.ply, points3d.ply, pointcloud.ply or "
        "cloud.ply beside it: a scene needs one, and edges need a depth image of each frame (\"depth_file_path\") "
        "instead.");
  }
  capture.up = up_by_convention({0, 0, 1}, rotations_of(capture.views));
  if (!cloud.empty()) capture.cloud = read_ply_file(cloud, middle_of(capture.views), report);
  // The name that nerfstudio gives to COLMAP's points.
  const std::string name = "sparse_pc.ply";
  capture.is_sparse = cloud.size() >= name.size() && cloud.compare(cloud.size() - name.size(), name.size(), name) == 0;
  capture.dropped = report.list();
  return capture;
}

// The end of a sentence about photos without cameras, or a film.
std::string how_to_find_cameras(const std::string& path) {
  return concatenate(
      " To find the cameras and make the scene: pip install 'maquette[scenes]', then python -m maquette ",
      "scene make ", path, " --out place.maqs.");
}

Capture open_any(const std::string& folder) {
  for (const char* place : {"sparse/0", "sparse", "colmap/sparse/0", "."}) {
    if (const auto files = ColmapFiles::find(folder + "/" + place)) return open_colmap(folder, *files);
  }
  for (const char* name : {"transforms.json", "transforms_train.json"}) {
    if (file_exists(folder + "/" + name)) return open_transforms(folder, name);
  }
  throw Error(
      MAQ_ERROR_NOT_FOUND, folder,
      " holds no capture: neither a COLMAP model (cameras, images and points3D, .bin or .txt, in sparse/0, sparse or "
      "the folder itself) nor a transforms.json.",
      how_to_find_cameras(folder));
}

}  // namespace

Capture open_capture(const std::string& folder) {
  if (file_exists(folder)) {
    throw Error(MAQ_ERROR_NOT_FOUND, folder, " is a file, not a folder with photos and cameras.",
                how_to_find_cameras(folder));
  }
  if (!is_folder(folder)) throw Error(MAQ_ERROR_NOT_FOUND, folder, " is not a folder; check the path.");
  Capture capture = open_any(folder);
  if (capture.cloud.count() == 0 && !has_depth(capture)) {
    std::string text;
    for (const Dropped& dropped : capture.dropped) {
      if (dropped.reason == kPointsNotFinite || dropped.reason == kColoursNotFinite) {
        text += (text.empty() ? ": " : ", ") + describe(dropped);
      }
    }
    throw Error(MAQ_ERROR_UNREADABLE, folder, " has a cloud without a point that can be used", text, ".");
  }
  return capture;
}

void load_depth(const CaptureView& view, Frame& depth, PinholeCamera& camera) {
  if (view.depth_path.empty()) {
    throw Error(MAQ_ERROR_NOT_FOUND, view.name,
                " has no depth image; name it in the capture's transforms.json as "
                "\"depth_file_path\".");
  }
  if (view.lens.distortion != Distortion::kNone) {
    throw Error(MAQ_ERROR_UNSUPPORTED, view.name,
                " was taken with a lens that distorts, and so is its depth; "
                "rectify the depth images first, and give the camera without distortion.");
  }
  const bool is_png = view.depth_path.size() > 4 && view.depth_path.substr(view.depth_path.size() - 4) == ".png";
  constexpr double kMillimetre = 0.001;
  read_depth_file(view.depth_path, view.depth_unit_m > 0 ? view.depth_unit_m : is_png ? kMillimetre : 1, depth);
  camera = resized(view.camera, depth.image.width_px, depth.image.height_px);
}

void load_view(const CaptureView& view, Frame& picture, std::vector<uint8_t>& valid) {
  Frame photo;
  const bool is_distorted = view.lens.distortion != Distortion::kNone;
  Frame& target = is_distorted ? photo : picture;
  read_image_file(view.image_path, target, Orientation::kAsStored);
  if (target.image.width_px != view.lens.width_px || target.image.height_px != view.lens.height_px) {
    throw Error(MAQ_ERROR_UNREADABLE, view.image_path, " is ", target.image.width_px, " x ", target.image.height_px,
                " pixels, but was ", view.lens.width_px, " x ", view.lens.height_px,
                " when the capture was opened; open it again.");
  }
  if (!is_distorted) {
    valid.assign(size_t(view.camera.width_px) * size_t(view.camera.height_px), 255);
    return;
  }
  Lens undistorted;
  undistorted.intrinsics() = view.camera.intrinsics();
  undistort(photo.image, view.lens, undistorted, picture, valid);
}

}  // namespace maq
