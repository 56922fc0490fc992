// The unchecked content of the three files of a COLMAP model, as text or binary (https://colmap.github.io/format.html).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace maq {

enum class ColmapModel { kSimplePinhole, kPinhole, kSimpleRadial, kRadial, kOpenCv, kOpenCvFisheye, kFullOpenCv };

struct ColmapCamera {
  uint32_t id = 0;
  ColmapModel model = ColmapModel::kPinhole;
  uint64_t width_px = 0, height_px = 0;
  std::array<double, 12> parameters{};  // in COLMAP's order for the model
};

struct ColmapImage {
  uint32_t id = 0;
  std::array<double, 4> rotation{};     // quaternion w, x, y, z: world to camera
  std::array<double, 3> translation{};  // of the world's origin into the camera
  uint32_t camera_id = 0;
  std::string name;
};

struct ColmapPoint {
  std::array<double, 3> position{};
  std::array<uint8_t, 3> rgb{};
};

class ColmapFiles {
 public:
  // The model in that folder, binary where there are both; nothing when there is none.
  static std::optional<ColmapFiles> find(const std::string& folder);

  // All throw MAQ_ERROR_UNREADABLE for files that are damaged or claim more than they hold, cameras()
  // MAQ_ERROR_UNSUPPORTED for other camera models, images() for more than kMaxImages.
  std::vector<ColmapCamera> cameras() const;
  std::vector<ColmapImage> images() const;
  // `take` gets one after the other; `announce` before how many there are, 0 when the file does not say.
  void points(const std::function<void(uint64_t)>& announce, const std::function<void(const ColmapPoint&)>& take) const;

  std::string points_path() const { return path("points3D"); }

  static constexpr size_t kMaxImages = 100'000;

 private:
  ColmapFiles(std::string folder, bool is_text) : folder_(std::move(folder)), is_text_(is_text) {}
  std::string path(const char* name) const { return folder_ + "/" + name + (is_text_ ? ".txt" : ".bin"); }

  std::string folder_;
  bool is_text_;
};

}  // namespace maq
