#include "scene/capture/colmap_files.h"

#include <cmath>

#include "core/files/file.h"
#include "core/files/file_reader.h"

namespace maq {
namespace {

struct ColmapModelInfo {
  const char* name;
  int number;
  size_t parameters;
};

// In the order of ColmapModel; numbers are the values in binary files.
constexpr ColmapModelInfo kColmapModels[] = {{"SIMPLE_PINHOLE", 0, 3}, {"PINHOLE", 1, 4}, {"SIMPLE_RADIAL", 2, 4},
                                             {"RADIAL", 3, 5},         {"OPENCV", 4, 8},  {"OPENCV_FISHEYE", 5, 8},
                                             {"FULL_OPENCV", 6, 12}};

const ColmapModelInfo& info_of(ColmapModel model) { return kColmapModels[size_t(model)]; }

constexpr size_t kMaxLineBytes = 4096;
constexpr size_t kMaxImageNameBytes = 1024;
constexpr char kKnownModels[] =
    "; the models that are read are SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV and "
    "OPENCV_FISHEYE. Let COLMAP's image_undistorter make pinhole cameras of it.";

// A line of a text file, word by word. Lines that are empty or comments are passed over.
class Line {
 public:
  explicit Line(FileReader& file) : file_(file) {}

  bool next() {
    while (file_.next_line(text_, kMaxLineBytes)) {
      at_ = 0;
      skip_spaces();
      if (at_ < text_.size() && text_[at_] != '#') return true;
    }
    return false;
  }

  std::string_view word(const char* what) {
    skip_spaces();
    const size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    if (at_ == begin) file_.fail(", line ", file_.line(), " ends before its ", what, ".");
    return std::string_view(text_).substr(begin, at_ - begin);
  }

  double number(const char* what) {
    const std::string_view text = word(what);
    double number = 0;
    if (!parse_number(text, number)) {
      file_.fail(", line ", file_.line(), ": the ", what, " \"", text.substr(0, 40), "\" is not a number.");
    }
    return number;
  }

  uint64_t whole(const char* what, double max) {
    const double value = number(what);
    if (!(value >= 0 && value <= max) || value != std::floor(value)) {
      file_.fail(", line ", file_.line(), ": the ", what, " is ", value, ", but must be a whole number from 0 to ", max,
                 ".");
    }
    return uint64_t(value);
  }

  std::string rest(const char* what) {
    skip_spaces();
    size_t end = text_.size();
    while (end > at_ && is_space(text_[end - 1])) --end;
    if (end == at_) file_.fail(", line ", file_.line(), " ends before its ", what, ".");
    return text_.substr(at_, end - at_);
  }

 private:
  static bool is_space(char letter) { return letter == ' ' || letter == '\t' || letter == '\r'; }
  void skip_spaces() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }

  FileReader& file_;
  std::string text_;
  size_t at_ = 0;
};

// Reads the number of elements; each takes `min_bytes` or more.
uint64_t read_count(FileReader& file, uint64_t min_bytes, const char* what) {
  const auto count = file.number<uint64_t>();
  if (count > file.remaining() / min_bytes) {
    file.fail(" claims ", count, " ", what, ", but has bytes for ", file.remaining() / min_bytes,
              " at most: it is truncated or damaged; copy it again.");
  }
  return count;
}

void expect_end(const FileReader& file, const char* what) {
  if (file.remaining() > 0) {
    file.fail(" has ", file.remaining(), " bytes after the last of its ", what, ": it is damaged; copy it again.");
  }
}

template <size_t count>
void read_numbers(FileReader& file, std::array<double, count>& numbers) {
  for (double& number : numbers) number = file.number<double>();
}

template <size_t count>
void read_numbers(Line& line, std::array<double, count>& numbers, const char* what) {
  for (double& number : numbers) number = line.number(what);
}

ColmapModel model_of(const FileReader& file, int number) {
  for (size_t i = 0; i < std::size(kColmapModels); ++i) {
    if (kColmapModels[i].number == number) return ColmapModel(i);
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " has a camera of model number ", number, kKnownModels);
}

ColmapModel model_of(const FileReader& file, std::string_view name) {
  for (size_t i = 0; i < std::size(kColmapModels); ++i) {
    if (kColmapModels[i].name == name) return ColmapModel(i);
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " has a camera of the model ", name.substr(0, 40), kKnownModels);
}

void check_image_count(const FileReader& file, uint64_t count) {
  if (count > ColmapFiles::kMaxImages) {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.path(), " has over ", ColmapFiles::kMaxImages, " images; leave some out.");
  }
}

std::vector<ColmapCamera> read_camera_lines(FileReader& file) {
  std::vector<ColmapCamera> cameras;
  for (Line line(file); line.next();) {
    ColmapCamera camera;
    camera.id = uint32_t(line.whole("camera's number", UINT32_MAX));
    camera.model = model_of(file, line.word("model"));
    camera.width_px = line.whole("width", 1e15);
    camera.height_px = line.whole("height", 1e15);
    for (size_t i = 0; i < info_of(camera.model).parameters; ++i) camera.parameters[i] = line.number("parameters");
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<ColmapCamera> read_camera_records(FileReader& file) {
  constexpr uint64_t kMinBytes = 4 + 4 + 8 + 8 + 3 * 8;
  std::vector<ColmapCamera> cameras(read_count(file, kMinBytes, "cameras"));
  for (ColmapCamera& camera : cameras) {
    camera.id = file.number<uint32_t>();
    camera.model = model_of(file, file.number<int32_t>());
    camera.width_px = file.number<uint64_t>();
    camera.height_px = file.number<uint64_t>();
    for (size_t i = 0; i < info_of(camera.model).parameters; ++i) camera.parameters[i] = file.number<double>();
  }
  expect_end(file, "cameras");
  return cameras;
}

std::vector<ColmapImage> read_image_lines(FileReader& file) {
  std::vector<ColmapImage> images;
  for (Line line(file); line.next();) {
    ColmapImage image;
    image.id = uint32_t(line.whole("image's number", UINT32_MAX));
    read_numbers(line, image.rotation, "rotation");
    read_numbers(line, image.translation, "translation");
    image.camera_id = uint32_t(line.whole("camera's number", UINT32_MAX));
    image.name = line.rest("name");
    check_image_count(file, images.size() + 1);
    images.push_back(std::move(image));
    // The points that were seen, on a line of their own that may be empty.
    std::string ignored;
    file.next_line(ignored, 0);
  }
  return images;
}

std::vector<ColmapImage> read_image_records(FileReader& file) {
  constexpr uint64_t kMinBytes = 4 + 7 * 8 + 4 + 1 + 8, kSeenPointBytes = 24;
  const uint64_t count = read_count(file, kMinBytes, "images");
  check_image_count(file, count);
  std::vector<ColmapImage> images(count);
  for (ColmapImage& image : images) {
    image.id = file.number<uint32_t>();
    read_numbers(file, image.rotation);
    read_numbers(file, image.translation);
    image.camera_id = file.number<uint32_t>();
    while (const char letter = file.number<char>()) {
      if (image.name.size() == kMaxImageNameBytes) {
        file.fail(" has an image whose name is over ", kMaxImageNameBytes, " letters: it is damaged; copy it again.");
      }
      image.name.push_back(letter);
    }
    file.skip(read_count(file, kSeenPointBytes, "points seen in an image") * kSeenPointBytes);
  }
  expect_end(file, "images");
  return images;
}

}  // namespace

std::optional<ColmapFiles> ColmapFiles::find(const std::string& folder) {
  for (const bool is_text : {false, true}) {
    ColmapFiles files(folder, is_text);
    if (file_exists(files.path("cameras")) && file_exists(files.path("images")) &&
        file_exists(files.path("points3D"))) {
      return files;
    }
  }
  return {};
}

std::vector<ColmapCamera> ColmapFiles::cameras() const {
  FileReader file(path("cameras"));
  return is_text_ ? read_camera_lines(file) : read_camera_records(file);
}

std::vector<ColmapImage> ColmapFiles::images() const {
  FileReader file(path("images"));
  return is_text_ ? read_image_lines(file) : read_image_records(file);
}

void ColmapFiles::points(const std::function<void(uint64_t)>& announce,
                         const std::function<void(const ColmapPoint&)>& take) const {
  FileReader file(path("points3D"));
  ColmapPoint point;
  if (is_text_) {
    announce(0);
    for (Line line(file); line.next();) {
      line.whole("point's number", double(UINT64_MAX));
      read_numbers(line, point.position, "position");
      for (uint8_t& value : point.rgb) value = uint8_t(line.whole("colour", 255));
      line.number("error");
      take(point);
    }
    return;
  }
  constexpr uint64_t kMinBytes = 8 + 3 * 8 + 3 + 8 + 8, kTrackEntryBytes = 8;
  const uint64_t count = read_count(file, kMinBytes, "points");
  announce(count);
  for (uint64_t i = 0; i < count; ++i) {
    file.number<uint64_t>();  // its number
    read_numbers(file, point.position);
    file.read(point.rgb.data(), 3);
    file.number<double>();  // its error
    file.skip(read_count(file, kTrackEntryBytes, "images of a point") * kTrackEntryBytes);
    take(point);
  }
  expect_end(file, "points");
}

}  // namespace maq
