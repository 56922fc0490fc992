#include "scene/capture/transforms_file.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/files/file.h"
#include "core/files/file_reader.h"
#include "core/json/json_value.h"
#include "image/files/image_file.h"

namespace maq {
namespace {

// Some 25,000 frames. Parsed, a hostile file takes twenty times as much.
constexpr uint64_t kMaxBytes = 16 << 20;

constexpr double kLargestDepthUnit = 1e6;

// The values for a frame: its own, or the file's for all frames.
class Facts {
 public:
  Facts(const JsonValue& frame, const JsonValue& shared, std::string where)
      : frame_(frame), shared_(shared), where_(std::move(where)) {}

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(MAQ_ERROR_UNREADABLE, where_, ": ", parts..., ".");
  }

  const JsonValue* find(const char* key) const {
    const JsonValue* const own = frame_.find(key);
    return own != nullptr ? own : shared_.find(key);
  }
  std::optional<double> number(const char* key) const {
    const JsonValue* value = find(key);
    if (value == nullptr) return {};
    if (!value->number()) fail("\"", key, "\" is not a number");
    return value->number();
  }
  double number_or(const char* key, double fallback) const { return number(key).value_or(fallback); }
  bool flag(const char* key) const {
    const JsonValue* value = find(key);
    if (value == nullptr) return false;
    if (value->flag() == nullptr) fail("\"", key, "\" is neither true nor false");
    return *value->flag();
  }
  std::string text(const char* key) const {
    const JsonValue* value = find(key);
    if (value == nullptr) return "";
    if (value->text() == nullptr) fail("\"", key, "\" is not a text");
    return *value->text();
  }

 private:
  const JsonValue& frame_;
  const JsonValue& shared_;
  std::string where_;
};

JsonValue parse(const std::string& path) {
  FileReader file(path);
  if (file.remaining() > kMaxBytes) {
    file.fail(" has ", file.remaining(), " bytes, over the limit of ", kMaxBytes, "; leave some frames out.");
  }
  std::string text(size_t(file.remaining()), '\0');
  file.read(text.data(), text.size());
  try {
    JsonValue document = JsonValue::parse(text);
    if (document.object() != nullptr) return document;
  } catch (const JsonError&) {
  }
  file.fail(" is not a JSON object: it is truncated or damaged, or has NaN in it.");
}

bool is_fisheye(const Facts& facts) {
  const std::string model = facts.text("camera_model");
  if (model == "OPENCV_FISHEYE") return true;
  for (const char* known : {"", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"}) {
    if (model == known) return facts.flag("is_fisheye");
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "The \"camera_model\" ", model.substr(0, 40),
              " is not read; OPENCV, OPENCV_FISHEYE, PINHOLE and SIMPLE_PINHOLE are. Undistort the photos first.");
}

int whole_pixels(double value) {
  return value >= 0 && value <= INT32_MAX && value == std::floor(value) ? int(value) : 0;
}

void read_distortion(const Facts& facts, Lens& lens) {
  auto& k = lens.coefficients;
  if (is_fisheye(facts)) {
    k = {facts.number_or("k1", 0), facts.number_or("k2", 0), facts.number_or("k3", 0), facts.number_or("k4", 0)};
    lens.distortion = Distortion::kFisheye;
    return;
  }
  // There k4 belongs to the eighth power of the radius, which the model of OpenCV does not have.
  if (facts.number_or("k4", 0) != 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A camera that is not a fisheye has \"k4\" ", facts.number_or("k4", 0),
                ", but k1, k2, k3, p1 and p2 are what is read. Undistort the photos first.");
  }
  k = {facts.number_or("k1", 0), facts.number_or("k2", 0), facts.number_or("p1", 0), facts.number_or("p2", 0),
       facts.number_or("k3", 0)};
  if (std::any_of(k.begin(), k.end(), [](double value) { return value != 0; })) lens.distortion = Distortion::kRational;
}

// Reads the camera, once width and height are known.
void read_intrinsics(const Facts& facts, Lens& lens) {
  const auto from_angle = [&](const char* key, int side_px) -> std::optional<double> {
    const auto angle = facts.number(key);
    if (!angle) return {};
    return 0.5 * side_px / std::tan(0.5 * *angle);
  };
  // Values in pixels are exact; angles are for files without them.
  auto across = facts.number("fl_x"), down = facts.number("fl_y");
  if (!across && !down) {
    across = from_angle("camera_angle_x", lens.width_px);
    down = from_angle("camera_angle_y", lens.height_px);
  }
  if (!across && !down) facts.fail("there is neither \"fl_x\" nor \"camera_angle_x\"");
  lens.fx_px = across ? *across : *down;
  lens.fy_px = down ? *down : *across;
  lens.cx_px = facts.number_or("cx", 0.5 * lens.width_px) - 0.5;
  lens.cy_px = facts.number_or("cy", 0.5 * lens.height_px) - 0.5;
  read_distortion(facts, lens);
}

void read_pose(const Facts& facts, PosedPhoto& photo) {
  const JsonValue* found = facts.find("transform_matrix");
  const JsonValue::List* matrix = found == nullptr ? nullptr : found->list();
  bool is_matrix = matrix != nullptr && (matrix->size() == 3 || matrix->size() == 4);
  double m[3][4] = {};
  for (size_t i = 0; i < 3 && is_matrix; ++i) {
    const JsonValue::List* row = (*matrix)[i].list();
    is_matrix = row != nullptr && row->size() == 4 && std::all_of(row->begin(), row->end(), [](const JsonValue& value) {
                  return value.number().has_value();
                });
    for (size_t k = 0; k < 4 && is_matrix; ++k) m[i][k] = *(*row)[k].number();
  }
  if (!is_matrix) facts.fail("\"transform_matrix\" is not one of 3 or 4 rows of 4 numbers");
  for (size_t i = 0; i < 3; ++i) {
    photo.rotation[i] = m[i][0];
    photo.rotation[3 + i] = -m[i][1];
    photo.rotation[6 + i] = -m[i][2];
    photo.centre[i] = m[i][3];
  }
}

std::string with_extension(const std::string& folder, const std::string& name) {
  if (file_exists(folder + "/" + name)) return name;
  for (const char* extension : {".png", ".jpg", ".jpeg"}) {
    if (file_exists(folder + "/" + name + extension)) return name + extension;
  }
  return name;
}

std::set<std::string> held_out_names(const JsonValue& document, const std::string& path) {
  std::set<std::string> names;
  const JsonValue* list = document.find("test_filenames");
  if (list == nullptr) return names;
  if (list->list() == nullptr) throw Error(MAQ_ERROR_UNREADABLE, path, ": \"test_filenames\" is not a list.");
  for (const JsonValue& name : *list->list()) {
    if (name.text() == nullptr) {
      throw Error(MAQ_ERROR_UNREADABLE, path, ": \"test_filenames\" has an entry that is not a text.");
    }
    names.insert(*name.text());
  }
  return names;
}

}  // namespace

TransformsFile read_transforms_file(const std::string& folder, const std::string& file_name, ImportReport& report) {
  const std::string path = folder + "/" + file_name;
  const JsonValue document = parse(path), none;
  TransformsFile read;
  read.cloud = Facts(none, document, path).text("ply_file_path");
  const JsonValue* listed = document.find("frames");
  const JsonValue::List* frames = listed == nullptr ? nullptr : listed->list();
  if (frames == nullptr) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " has no list \"frames\".");
  }
  const std::set<std::string> held_out = held_out_names(document, path);
  for (size_t i = 0; i < frames->size(); ++i) {
    const std::string where = path + ", frame " + std::to_string(i);
    const JsonValue& frame = (*frames)[i];
    if (frame.object() == nullptr) throw Error(MAQ_ERROR_UNREADABLE, where, ": it is not a JSON object.");
    const Facts facts(frame, document, where);
    PosedPhoto photo;
    photo.name = facts.text("file_path");
    if (photo.name.empty()) facts.fail("\"file_path\" is missing");
    photo.is_held_out = held_out.count(photo.name) != 0;
    photo.depth_name = facts.text("depth_file_path");
    if (const auto unit = facts.number("depth_unit_scale_factor")) {
      photo.depth_unit_m = *unit;
      if (!(*unit > 0 && *unit <= kLargestDepthUnit)) {
        facts.fail("\"depth_unit_scale_factor\" is ", *unit, ", but must be above 0, at most ", kLargestDepthUnit);
      }
    }
    read_pose(facts, photo);
    if (!stays_inside(photo.name)) {
      report.add(kPhotosOutside, photo.name);
      continue;
    }
    photo.name = with_extension(folder, photo.name);
    if (facts.find("w") != nullptr && facts.find("h") != nullptr) {
      photo.lens.width_px = whole_pixels(facts.number_or("w", 0));
      photo.lens.height_px = whole_pixels(facts.number_or("h", 0));
    } else {
      try {
        const SizePx size = read_image_file_size(folder + "/" + photo.name);
        photo.lens.width_px = whole_pixels(double(size.width));
        photo.lens.height_px = whole_pixels(double(size.height));
      } catch (const Error& error) {
        if (error.status() == MAQ_ERROR_OUT_OF_MEMORY) throw;
        report.add(error.status() == MAQ_ERROR_NOT_FOUND ? kPhotosMissing : kPhotosUnreadable, photo.name);
        continue;
      }
    }
    read_intrinsics(facts, photo.lens);
    read.photos.push_back(std::move(photo));
  }
  return read;
}

}  // namespace maq
