// Scenes and captures: files that other programs wrote.
#include <filesystem>
#include <fstream>

#include "checked_file.h"
#include "scene/capture/colmap_model.h"
#include "scene/capture/ply_reader.h"
#include "scene/capture/transforms_file.h"
#include "scene/format/block_codec.h"
#include "scene/format/scene_file.h"
#include "scene/format/scene_file_format.h"
#include "scene/format/scene_packing.h"
#include "scene/splats/files/gzip_file.h"
#include "scene/splats/files/splat_files.h"
#include "scene/splats/splat_renderer.h"
#include "support/samples/fitted_scene.h"
#include "support/samples/made_splats.h"
#include "support/temp_folder.h"

using namespace maq;

namespace {

constexpr std::array<double, 3> kOrigin = {0, 0, 0};

std::vector<fuzz::Bytes> scene_seeds() {
  std::vector<fuzz::Bytes> seeds;
  const TempFolder folder;
  for (const CoefficientFormat format :
       {CoefficientFormat::kFloat32, CoefficientFormat::kInt16, CoefficientFormat::kInt8}) {
    const PositionFormat positions =
        format == CoefficientFormat::kFloat32 ? PositionFormat::kFloat32 : PositionFormat::kUint16;
    write_scene_file(make_scene(ball_over_a_floor(9), {positions, format, 0}), folder.file("a.maqs"));
    seeds.push_back(fuzz::bytes_of(read_text(folder.file("a.maqs"))));
  }
  return seeds;
}

// With true lengths and checksums.
fuzz::Bytes repaired_scene(fuzz::Bytes bytes) {
  SceneFileHead head;
  if (bytes.size() < sizeof head) return bytes;
  std::memcpy(&head, bytes.data(), sizeof head);
  head.file_bytes = bytes.size();
  for (SceneFileSpan& span : head.sections) {
    if (span.offset > bytes.size() || span.bytes > bytes.size()) continue;
    const size_t count = filled_up(span.bytes);
    if (count <= bytes.size() - span.offset) span.check = XXH3_64bits(bytes.data() + span.offset, count);
  }
  constexpr size_t kChecked = offsetof(SceneFileHead, file_bytes);
  head.head_check = XXH3_64bits(&head.file_bytes, sizeof head - kChecked);
  std::memcpy(bytes.data(), &head, sizeof head);
  return bytes;
}

// A byte for compressed or not, and the file.
std::vector<fuzz::Bytes> splat_seeds() {
  std::vector<fuzz::Bytes> seeds;
  for (int degree = 0; degree <= 3; ++degree) {
    const MadeSplats made = made_splats(6, degree);
    for (const char* form : {"ascii", "binary_little_endian"}) {
      seeds.push_back(fuzz::bytes_of(std::string(1, '\0') + made.ply(form)));
    }
    for (const uint32_t version : {2u, 3u}) {
      fuzz::Bytes seed = {1};
      const std::vector<uint8_t> file = made.spz(version);
      seed.insert(seed.end(), file.begin(), file.end());
      seeds.push_back(seed);
    }
  }
  return seeds;
}

// A byte for text or binary, the lengths of two files, and the three files.
std::vector<fuzz::Bytes> colmap_seeds() {
  const auto seed = [](bool is_text, const fuzz::Writer& cameras, const fuzz::Writer& images,
                       const fuzz::Writer& points) {
    fuzz::Writer all;
    all.add(uint8_t(is_text)).add(uint16_t(cameras.bytes.size())).add(uint16_t(images.bytes.size()));
    for (const fuzz::Writer* part : {&cameras, &images, &points}) all.text(fuzz::text_of(part->bytes));
    return all.bytes;
  };
  const auto text = [](const char* given) { return fuzz::Writer().text(given); };
  fuzz::Writer cameras, images, points;
  cameras.add(uint64_t(1)).add(uint32_t(7)).add(int32_t(1)).add(uint64_t(32)).add(uint64_t(24));
  for (const double value : {30.0, 31.0, 16.25, 11.5}) cameras.add(value);
  images.add(uint64_t(1)).add(uint32_t(1));
  for (const double value : {1.0, 0.0, 0.0, 0.0, 0.25, -0.5, 0.125}) images.add(value);
  images.add(uint32_t(7)).text("a.png").add('\0').add(uint64_t(1)).add(3.5).add(4.5).add(int64_t(1));
  points.add(uint64_t(1)).add(uint64_t(1)).add(0.5).add(-0.25).add(4.0).add('a').add('b').add('c').add(0.1);
  points.add(uint64_t(1)).add(int32_t(1)).add(int32_t(0));
  return {seed(false, cameras, images, points),
          seed(true, text("7 PINHOLE 32 24 30 31 16.25 11.5\n8 OPENCV 32 24 30 31 16 11 0.1 0.01 0 0\n"),
               text("# list\n1 1 0 0 0 0.25 -0.5 0.125 7 a.png\n3.5 4.5 -1\n2 0.6 0 0.8 0 1 2 3 8 b.png\n\n"),
               text("1 0.5 -0.25 4 255 0 10 0.1 1 0\n2 0 0 4 1 2 3 0.2 1 1 2 1\n"))};
}

// A folder in memory, if there is one, that all inputs use.
const std::string& folder() {
  static const TempFolder* const kept = [] {
    if (access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 1);
    return new TempFolder;
  }();
  static const std::string path = kept->path().string();
  return path;
}

void write_file(const std::string& path, const fuzz::Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), ptrdiff_t(bytes.size()));
}

void check_photos(const std::vector<PosedPhoto>& photos) {
  for (const PosedPhoto& photo : photos) fuzz::require(!photo.name.empty(), "a photo without a name");
}

}  // namespace

SEEDED_FUZZ(scene_file, scene_seeds) {
  const fuzz::Bytes file = repaired_scene(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const Scene scene = open_scene_memory(file.data(), file.size());
    uint32_t count = 0;
    for (uint32_t b = 0; b < scene.block_count; ++b) {
      const FittedPoints points = decode_block(scene, scene.blocks[b]);
      count += uint32_t(points.count());
      for (const auto* values : {&points.x, &points.y, &points.z, &points.constant_terms, &points.linear_terms}) {
        for (const float value : *values) fuzz::require(std::abs(value) <= 2e30f, "a number that is not finite");
      }
    }
    fuzz::require(count == scene.points, "the number of points");
    bounds_of(scene);
  });
}

FUZZ(ply) {
  const fuzz::MemoryFile file(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    ImportReport report;
    read_ply_file(file.path(), kOrigin, report);
  });
}

SEEDED_FUZZ(splats, splat_seeds) {
  if (bytes.empty()) return;
  // As it is, or compressed: an SPZ file that is changed after compression is rarely read far.
  const fuzz::Bytes rest(bytes.begin() + 1, bytes.end());
  const fuzz::MemoryFile file(bytes[0] % 2 == 0 ? rest : gzip_of(rest));
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const Splats splats = read_splat_file(file.path());
    fuzz::require(splats.count() > 0, "no splats");
    PinholeCamera camera;
    camera.width_px = camera.height_px = 40;
    camera.fx_px = camera.fy_px = 30;
    camera.centre = {0, 0, -2};
    SplatRenderer renderer(splats, {});
    RenderedImage image;
    renderer.render(camera, image);
    for (const float depth : image.depth) fuzz::require(std::isfinite(depth), "a depth that is not finite");
  });
}

SEEDED_FUZZ(colmap, colmap_seeds) {
  fuzz::Numbers numbers(bytes);
  const bool is_text = numbers.take<uint8_t>() % 2 != 0;
  const std::string in = folder() + (is_text ? "/text" : "/binary"), extension = is_text ? ".txt" : ".bin";
  std::filesystem::create_directories(in);
  const auto camera_bytes = numbers.take<uint16_t>(), image_bytes = numbers.take<uint16_t>();
  write_file(in + "/cameras" + extension, numbers.bytes(camera_bytes));
  write_file(in + "/images" + extension, numbers.bytes(image_bytes));
  write_file(in + "/points3D" + extension, numbers.rest());
  const auto files = ColmapFiles::find(in);
  fuzz::require(files.has_value(), "a model that is not found");
  ImportReport report;
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED},
                      [&] { check_photos(read_colmap_photos(*files, report)); });
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED},
                      [&] { read_colmap_points(*files, kOrigin, report); });
}

FUZZ(transforms) {
  write_file(folder() + "/transforms.json", bytes);
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    ImportReport report;
    check_photos(read_transforms_file(folder(), "transforms.json", report).photos);
  });
}
