#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <iostream>

#include "scene/capture/ply_reader.h"
#include "scene/format/block_codec.h"
#include "scene/format/ply_writer.h"
#include "scene/format/scene_file.h"
#include "scene/format/scene_packing.h"
#include "support/expect_error.h"
#include "support/file_size_limit.h"
#include "support/peak_memory.h"
#include "support/samples/fitted_scene.h"
#include "support/temp_folder.h"

namespace {

bool dies_at_the_disk = false;

}  // namespace

// In place of the system's, for a process that dies when all is written and nothing is safe.
extern "C" int fsync(int file) {
  if (dies_at_the_disk) std::raise(SIGKILL);
  return fdatasync(file);
}

namespace {

using maq::CoefficientFormat;
using maq::PositionFormat;
using maq::Scene;

bool are_same(const void* a, const void* b, size_t bytes) { return bytes == 0 || std::memcmp(a, b, bytes) == 0; }

void expect_same(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.networks_sha256, b.networks_sha256);
  ASSERT_EQ(a.position_format, b.position_format);
  ASSERT_EQ(a.coefficient_format, b.coefficient_format);
  ASSERT_EQ(a.points, b.points);
  ASSERT_EQ(a.view_dependent, b.view_dependent);
  ASSERT_EQ(a.block_count, b.block_count);
  EXPECT_TRUE(are_same(a.blocks, b.blocks, blocks_bytes(a)));
  EXPECT_TRUE(are_same(a.positions, b.positions, positions_bytes(a)));
  EXPECT_TRUE(are_same(a.constant_terms, b.constant_terms, constant_terms_bytes(a)));
  EXPECT_TRUE(are_same(a.linear_terms, b.linear_terms, linear_terms_bytes(a)));
}

size_t files_in(const TempFolder& folder) {
  return size_t(std::distance(std::filesystem::directory_iterator(folder.path()), {}));
}

TEST(SceneFiles, KeepScenesOfEveryKind) {
  TempFolder folder;
  const maq::FittedPoints points = ball_over_a_floor(3'000);
  for (const PositionFormat positions : {PositionFormat::kFloat32, PositionFormat::kUint16}) {
    for (const CoefficientFormat kind :
         {CoefficientFormat::kFloat32, CoefficientFormat::kInt16, CoefficientFormat::kInt8}) {
      for (const float min : {0.0f, 0.1f, 100.0f}) {
        Scene scene = make_scene(points, {positions, kind, min});
        for (size_t i = 0; i < 32; ++i) scene.networks_sha256[i] = uint8_t(200 + i);
        write_scene_file(scene, folder.file("a.maqs"));
        expect_same(maq::open_scene_file(folder.file("a.maqs")), scene);
        const std::string bytes = read_text(folder.file("a.maqs"));
        expect_same(maq::open_scene_memory(bytes.data(), bytes.size()), scene);
      }
    }
  }
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(SceneFiles, ASceneOfOnePointIsOne) {
  TempFolder folder;
  const Scene scene = make_scene(ball_over_a_floor(1), {});
  write_scene_file(scene, folder.file("a.maqs"));
  expect_same(maq::open_scene_file(folder.file("a.maqs")), scene);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "no points", [&] { write_scene_file(Scene(), folder.file("b.maqs")); });
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(SceneFiles, AnOpenSceneStaysWhenItsFileIsWrittenAnewOrRemoved) {
  TempFolder folder;
  const std::string path = folder.file("a.maqs");
  const Scene first = make_scene(ball_over_a_floor(2'000, 1), {}), second = make_scene(ball_over_a_floor(500, 2), {});
  write_scene_file(first, path);
  const Scene opened = maq::open_scene_file(path);
  write_scene_file(second, path);
  expect_same(opened, first);
  const Scene opened_second = maq::open_scene_file(path);
  std::filesystem::remove(path);
  expect_same(opened, first);
  expect_same(opened_second, second);
}

TEST(SceneFiles, ASceneFromMemoryKeepsNothingOfItAndNeedsNoAlignment) {
  TempFolder folder;
  const Scene scene = make_scene(ball_over_a_floor(2'000), {PositionFormat::kFloat32, CoefficientFormat::kFloat32, 0});
  write_scene_file(scene, folder.file("a.maqs"));
  for (size_t shift = 0; shift < 4; ++shift) {
    std::string bytes = std::string(shift, 'x') + read_text(folder.file("a.maqs"));
    const Scene opened = maq::open_scene_memory(bytes.data() + shift, bytes.size() - shift);
    std::fill(bytes.begin(), bytes.end(), '\xff');
    bytes = {};
    expect_same(opened, scene);
  }
}

TEST(SceneFiles, AFullDiskLeavesTheOldFile) {
  TempFolder folder;
  const std::string path = folder.file("a.maqs"), ply = folder.file("a.ply");
  const Scene small = make_scene(ball_over_a_floor(100), {}), large = make_scene(ball_over_a_floor(20'000), {});
  write_scene_file(small, path);
  write_scene_ply(small, ply);
  const std::string old_ply = read_text(ply);
  write_scene_file(large, folder.file("large.maqs"));
  const rlim_t whole = std::filesystem::file_size(folder.file("large.maqs"));
  std::filesystem::remove(folder.file("large.maqs"));
  // At the head, in the blocks, the positions, the coefficients, and at the last byte.
  for (const rlim_t max : {rlim_t(0), rlim_t(100), rlim_t(5'000), rlim_t(20'000), rlim_t(200'000), whole - 1}) {
    const FileSizeLimit limit(max);
    expect_error(MAQ_ERROR_UNWRITABLE, "cannot be written", [&] { write_scene_file(large, path); });
    if (max < 300'000) {
      expect_error(MAQ_ERROR_UNWRITABLE, "cannot be written", [&] { write_scene_ply(large, ply); });
    }
  }
  expect_same(maq::open_scene_file(path), small);
  EXPECT_EQ(read_text(ply), old_ply);
  EXPECT_EQ(files_in(folder), 2u);
  write_scene_file(large, path);
  expect_same(maq::open_scene_file(path), large);
}

TEST(SceneFiles, AProcessThatDiesWhileItWritesLeavesTheOldFile) {
  TempFolder folder;
  const std::string path = folder.file("a.maqs");
  const Scene small = make_scene(ball_over_a_floor(100), {}), large = make_scene(ball_over_a_floor(20'000), {});
  write_scene_file(small, path);
  const pid_t child = fork();
  if (child == 0) {
    dies_at_the_disk = true;
    write_scene_file(large, path);
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(files_in(folder), 2u);  // what it had written is beside it
  expect_same(maq::open_scene_file(path), small);
  write_scene_file(large, path);
  expect_same(maq::open_scene_file(path), large);
}

TEST(SceneFiles, WhatIsNoSceneIsOneSentence) {
  TempFolder folder;
  const auto open = [&](const std::string& name) { maq::open_scene_file(folder.file(name)); };
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { open("nothing.maqs"); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file", [&] { open("."); });
  write_text(folder.file("empty"), "");
  expect_error(MAQ_ERROR_UNREADABLE, "too short", [&] { open("empty"); });
  write_text(folder.file("text"), std::string(5'000, 'x'));
  expect_error(MAQ_ERROR_UNREADABLE, "is not a scene", [&] { open("text"); });
  expect_error(MAQ_ERROR_UNREADABLE, "in memory is too short", [&] { maq::open_scene_memory(nullptr, 0); });
  const std::string text(5'000, 'x');
  expect_error(MAQ_ERROR_UNREADABLE, "in memory is not a scene", [&] { maq::open_scene_memory(text.data(), 5'000); });
}

TEST(SceneFiles, ThePlyHasTheScenesPointsAndColours) {
  TempFolder folder;
  maq::FittedPoints points = ball_over_a_floor(5'000);
  points.constant_terms[0] = -0.5f;  // darker than black
  points.constant_terms[1] = 7;
  for (const bool is_far : {false, true}) {
    if (is_far) points.origin = {4e6, -5e5, 1e7};
    for (const PositionFormat positions : {PositionFormat::kFloat32, PositionFormat::kUint16}) {
      const Scene scene = make_scene(points, {positions, CoefficientFormat::kInt8, 0});
      write_scene_ply(scene, folder.file("a.ply"));
      EXPECT_EQ(
          read_text(folder.file("a.ply")).find(is_far ? "property double x" : "property float x") != std::string::npos,
          true);
      maq::ImportReport report;
      const maq::PointCloud cloud = maq::read_ply_file(folder.file("a.ply"), points.origin, report);
      EXPECT_TRUE(report.list().empty());
      ASSERT_EQ(cloud.count(), 5'000u);
      const float tolerance = is_far ? 1e-6f : 1e-5f;
      for (uint32_t b = 0; b < scene.block_count; ++b) {
        const maq::SceneBlock& block = scene.blocks[b];
        const maq::FittedPoints part = decode_block(scene, block);
        for (uint32_t k = 0; k < block.count; ++k) {
          const size_t i = block.first + k;
          ASSERT_NEAR(cloud.x[i], part.x[k], tolerance);
          ASSERT_NEAR(cloud.y[i], part.y[k], tolerance);
          ASSERT_NEAR(cloud.z[i], part.z[k], tolerance);
          for (size_t c = 0; c < 3; ++c) {
            const float wanted = 255 * std::clamp(part.constant_terms[k * size_t(maq::kFeatures) + c], 0.0f, 1.0f);
            ASSERT_NEAR(cloud.rgb[3 * i + c], wanted, 0.501f);
          }
        }
      }
    }
  }
}

TEST(SceneFiles, AMillionPointsAreOpenedWithoutBeingCopied) {
  TempFolder folder;
  const std::string path = folder.file("a.maqs");
  write_scene_file(make_scene(ball_over_a_floor(1'000'000), {}), path);
  const double file_mib = double(std::filesystem::file_size(path)) / 1048576;
  const std::string bytes = read_text(path);
  for (const bool is_mapped : {true, false}) {
    double seconds = 0;
    const double grown_mib = peak_memory_growth_mib([&] {
      const auto begin = std::chrono::steady_clock::now();
      const Scene scene = is_mapped ? maq::open_scene_file(path) : maq::open_scene_memory(bytes.data(), bytes.size());
      seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      EXPECT_EQ(scene.points, 1'000'000u);
    });
    std::cout << (is_mapped ? "mapped" : "from memory") << ": " << file_mib << " MiB opened in " << 1e3 * seconds
              << " ms, " << grown_mib << " MiB\n";
    EXPECT_LT(grown_mib, is_mapped ? 8 : file_mib + 8);
  }
}

}  // namespace
