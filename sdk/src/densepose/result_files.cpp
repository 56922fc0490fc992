#include "densepose/result_files.h"

#include <cmath>
#include <filesystem>

#include "core/files/atomic_file.h"
#include "core/json/json_text.h"
#include "image/files/image_file.h"

namespace maq {
namespace {

// Coordinates have a hundredth of a pixel and scores four digits, without the noise of converting floats to text.
double rounded(double value, double steps) { return std::round(value * steps) / steps; }

std::string json_of(const DensePoseResult& result) {
  JsonText json;
  json.begin_object().member("width", result.planes.width_px).member("height", result.planes.height_px);
  json.key("people").begin_list();
  for (size_t i = 0; i < result.people.size(); ++i) {
    const Person& person = result.people[i];
    json.begin_object().key("box").begin_list();
    for (const float edge : {person.box.x0, person.box.y0, person.box.x1, person.box.y1}) {
      json.value(rounded(double(edge), 100));
    }
    json.end_list().member("score", rounded(double(person.score), 10000)).member("id", person.id);
    if (!result.keypoints.empty()) {
      json.key("keypoints").begin_list();
      for (const Keypoint& keypoint : result.keypoints[i]) {
        json.begin_list().value(rounded(double(keypoint.x_px), 100)).value(rounded(double(keypoint.y_px), 100));
        json.value(rounded(double(keypoint.confidence), 10000)).end_list();
      }
      json.end_list();
    }
    json.end_object();
  }
  return json.end_list().end_object().text() + "\n";
}

ImageView view_of(maq_pixel_format format, const DensePlanes& planes, const uint8_t* pixels) {
  return packed_view(format, planes.width_px, planes.height_px, pixels);
}

// In the order of channels that the file has: I, U, V.
std::vector<uint8_t> interleaved(const DensePlanes& planes) {
  std::vector<uint8_t> pixels(3 * planes.part.size());
  for (size_t i = 0; i < planes.part.size(); ++i) {
    pixels[3 * i] = planes.part[i];
    pixels[3 * i + 1] = planes.u[i];
    pixels[3 * i + 2] = planes.v[i];
  }
  return pixels;
}

}  // namespace

void write_result_files(const DensePoseResult& result, const std::string& folder, const std::string& stem) {
  const auto path_of = [&](const char* suffix) {
    return (std::filesystem::u8path(folder) / std::filesystem::u8path(stem + suffix)).string();
  };
  AtomicFile iuv_file(path_of("_IUV.png")), inds_file(path_of("_INDS.png")), json_file(path_of(".json"));
  const std::vector<uint8_t> pixels = interleaved(result.planes);
  const std::vector<uint8_t> iuv = encode_image(view_of(MAQ_PIXEL_BGR8, result.planes, pixels.data()), ".png");
  const std::vector<uint8_t> inds =
      encode_image(view_of(MAQ_PIXEL_GREY8, result.planes, result.planes.person.data()), ".png");
  const std::string json = json_of(result);
  iuv_file.append(iuv.data(), iuv.size());
  inds_file.append(inds.data(), inds.size());
  json_file.append(json.data(), json.size());
  for (AtomicFile* file : {&iuv_file, &inds_file, &json_file}) file->commit();
}

}  // namespace maq
