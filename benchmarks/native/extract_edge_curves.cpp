// Extracts curves from the fields in a file of benchmarks/edges/curve_extraction.py; prints a JSON object for each
// view.
//   extract_edge_curves FIELDS
// FIELDS: for each view int32 width, height; float64 fx, fy, cx, cy, eps_r, spread_r; the planes distance_r (float32),
// depth_m (float32) and kind (uint8).
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "edges/curves/curve_extractor.h"

namespace {

template <class T>
void read(std::FILE* file, T* to, size_t count) {
  if (std::fread(to, sizeof(T), count, file) != count) throw std::runtime_error("the file of fields ends in a view");
}

bool read_field(std::FILE* file, maq::EdgeField& field) {
  int32_t size[2];
  if (std::fread(size, sizeof(size), 1, file) != 1) return false;
  double numbers[6];
  read(file, numbers, 6);
  field.width = size[0], field.height = size[1];
  field.intrinsics.width_px = size[0], field.intrinsics.height_px = size[1];
  field.intrinsics.fx_px = numbers[0], field.intrinsics.fy_px = numbers[1];
  field.intrinsics.cx_px = numbers[2], field.intrinsics.cy_px = numbers[3];
  field.eps_r = float(numbers[4]);
  const size_t pixels = size_t(size[0]) * size_t(size[1]);
  field.distance_r.resize(pixels), field.depth_m.resize(pixels), field.kind.resize(pixels);
  field.expected_error_r.assign(pixels, float(numbers[5]));
  read(file, field.distance_r.data(), pixels);
  read(file, field.depth_m.data(), pixels);
  read(file, field.kind.data(), pixels);
  return true;
}

void print(const maq::EdgeCurves& found) {
  const char* types[] = {"line", "arc", "spline"};
  std::printf("{\"curves\": [");
  for (size_t i = 0; i < found.curves.size(); ++i) {
    const maq::EdgeCurve& curve = found.curves[i];
    std::printf("%s{\"kind\": %d, \"type\": \"%s\", \"points\": [", i > 0 ? ", " : "", int(curve.kind),
                types[int(curve.type)]);
    for (int k = 0; k < curve.point_count; ++k) {
      const maq::Vec3& p = found.points[size_t(curve.first_point + k)];
      std::printf("%s[%.8g, %.8g, %.8g]", k > 0 ? ", " : "", p.x, p.y, p.z);
    }
    std::printf("]}");
  }
  std::printf("]}\n");
}

}  // namespace

int main(int count, char** arguments) {
  try {
    if (count != 2) throw std::invalid_argument("usage: extract_edge_curves FIELDS");
    maq::CurveExtractor extractor{maq::CurveOptions{}};
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(arguments[1], "rb"), std::fclose);
    if (!file) throw std::runtime_error(std::string(arguments[1]) + " cannot be opened");
    maq::EdgeField field;
    while (read_field(file.get(), field)) print(extractor.extract(field));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
