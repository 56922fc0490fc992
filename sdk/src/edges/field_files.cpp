#include "edges/field_files.h"

#include <cmath>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "core/json/json_text.h"
#include "image/files/image_codecs.h"
#include "image/files/image_file.h"

namespace maq {
namespace {

constexpr double kUnit_r = 0.001;  // of a stored 1

std::string json_of(const EdgeField& field) {
  const Intrinsics& camera = field.intrinsics;
  JsonText json(2);
  json.begin_object().member("width", field.width).member("height", field.height).member("distance_unit_r", kUnit_r);
  json.member("eps_r", double(field.eps_r)).key("intrinsics").begin_object();
  json.member("fx_px", camera.fx_px).member("fy_px", camera.fy_px);
  json.member("cx_px", camera.cx_px).member("cy_px", camera.cy_px);
  return json.end_object().end_object().text() + "\n";
}

std::vector<uint8_t> distance_png(const EdgeField& field) {
  std::vector<uint16_t> units(field.distance_r.size());
  for (size_t i = 0; i < units.size(); ++i) units[i] = uint16_t(std::lround(double(field.distance_r[i]) / kUnit_r));
  const auto* const bytes = reinterpret_cast<const uint8_t*>(units.data());
  return encode_depth_image(".png", packed_view(MAQ_PIXEL_DEPTH16, field.width, field.height, bytes));
}

}  // namespace

void write_field_files(const EdgeField& field, const std::string& path) {
  AtomicFile distance_file(path + "_distance.png"), kind_file(path + "_kind.png"), json_file(path + "_edges.json");
  const std::vector<uint8_t> distance = distance_png(field);
  const ImageView kinds = packed_view(MAQ_PIXEL_GREY8, field.width, field.height, field.kind.data());
  const std::vector<uint8_t> kind = encode_image(kinds, ".png");
  const std::string json = json_of(field);
  distance_file.append(distance.data(), distance.size());
  kind_file.append(kind.data(), kind.size());
  json_file.append(json.data(), json.size());
  for (AtomicFile* file : {&distance_file, &kind_file, &json_file}) file->commit();
}

}  // namespace maq
