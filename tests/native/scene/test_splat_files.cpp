// Splats from PLY and SPZ files, and files that are damaged or something else.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "scene/splats/files/gzip_file.h"
#include "scene/splats/files/splat_files.h"
#include "support/expect_error.h"
#include "support/samples/made_splats.h"
#include "support/temp_folder.h"

namespace {

class SplatFiles : public ::testing::Test {
 protected:
  maq::Splats read(const std::string& bytes) {
    write_text(folder_.file("splats"), bytes);
    return maq::read_splat_file(folder_.file("splats"));
  }
  maq::Splats read_spz(const std::vector<uint8_t>& bytes) { return read(compressed(bytes)); }
  static std::string compressed(const std::vector<uint8_t>& bytes) {
    const std::vector<uint8_t> made = maq::gzip_of(bytes);
    return {made.begin(), made.end()};
  }
  void expect_refused(const std::string& bytes, const std::string& part, maq_status status = MAQ_ERROR_UNREADABLE) {
    expect_error(status, part, [&] { read(bytes); });
  }
  // Where the splat's axes of unit length point to: the same for a quaternion and its negative.
  static std::array<double, 9> axes(double w, double x, double y, double z) {
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  }
  static void expect_near(const maq::Splats& read, const MadeSplats& made, double position, double relative_scale,
                          double turn, double opacity, double colour, double harmonic) {
    ASSERT_EQ(read.count(), made.splats.size());
    ASSERT_EQ(read.sh_degree, made.degree);
    const size_t terms = 3 * size_t(made.terms());
    ASSERT_EQ(read.sh.size(), terms * made.splats.size());
    for (size_t i = 0; i < made.splats.size(); ++i) {
      const MadeSplat& splat = made.splats[i];
      const float* const q = &read.rotation[4 * i];
      const auto found = axes(double(q[0]), double(q[1]), double(q[2]), double(q[3]));
      const auto wanted = axes(splat.rotation[0], splat.rotation[1], splat.rotation[2], splat.rotation[3]);
      for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(found[k], wanted[k], turn) << i;
      for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(read.origin[k] + double(read.position[3 * i + k]), splat.position[k], position);
        EXPECT_NEAR(double(read.scale[3 * i + k]) / splat.scale[k], 1, relative_scale);
        EXPECT_NEAR(double(read.colour[3 * i + k]), 0.5 + 0.28209479 * splat.coefficient[k], colour);
      }
      EXPECT_NEAR(double(read.opacity[i]), splat.opacity, opacity);
      for (size_t k = 0; k < terms; ++k) {
        EXPECT_NEAR(double(read.sh[terms * i + k]) * double(maq::kShStep), splat.sh[k], harmonic);
      }
    }
  }

  const TempFolder folder_;
};

TEST_F(SplatFiles, APlyFileOfEveryFormAndDegreeGivesItsSplats) {
  for (int degree = 0; degree <= 3; ++degree) {
    const MadeSplats made = made_splats(7, degree);
    for (const char* form : {"ascii", "binary_little_endian", "binary_big_endian"}) {
      expect_near(read(made.ply(form)), made, 1e-6, 1e-5, 1e-5, 1e-6, 1e-6, 1.3e-4);
    }
  }
}

TEST_F(SplatFiles, AnSpzFileOfBothVersionsGivesItsSplats) {
  for (int degree = 0; degree <= 3; ++degree) {
    const MadeSplats made = made_splats(40, degree);
    // 12 bits behind the point, steps of 1/16 in the logarithm, and bytes.
    expect_near(read_spz(made.spz(3)), made, 1.3e-4, 0.033, 4e-3, 2e-3, 4e-3, 4.1e-3);
    expect_near(read_spz(made.spz(2)), made, 1.3e-4, 0.033, 0.2, 2e-3, 4e-3, 4.1e-3);
  }
}

TEST_F(SplatFiles, HarmonicsOfDegree4AreSkipped) {
  const MadeSplats made = made_splats(5, 3);
  std::vector<uint8_t> bytes = made.spz(3, 0, 4);
  const size_t begin = bytes.size() - 5 * 45;
  std::vector<uint8_t> with_fourth(bytes.begin(), bytes.begin() + std::ptrdiff_t(begin));
  for (size_t i = 0; i < 5; ++i) {
    with_fourth.insert(with_fourth.end(), bytes.begin() + std::ptrdiff_t(begin + 45 * i),
                       bytes.begin() + std::ptrdiff_t(begin + 45 * i + 45));
    with_fourth.insert(with_fourth.end(), 27, uint8_t(17));
  }
  expect_near(read_spz(with_fourth), made, 1.3e-4, 0.033, 4e-3, 2e-3, 4e-3, 4.1e-3);
}

TEST_F(SplatFiles, SplatsWithoutAThirdScaleAreFlat) {
  const maq::Splats splats = read(made_splats(3, 0).ply("binary_little_endian", "scale_2"));
  ASSERT_EQ(splats.count(), 3u);
  EXPECT_GT(splats.scale[2], 0);
  EXPECT_LT(splats.scale[2], 1e-8f);
}

TEST_F(SplatFiles, SplatsThatAreNoNumbersHaveNoRotationOrAreTooLargeAreLeftOut) {
  MadeSplats made = made_splats(8, 1);
  made.splats[0].position[1] = std::numeric_limits<double>::quiet_NaN();
  made.splats[1].position[0] = std::numeric_limits<double>::infinity();
  made.splats[2].rotation = {0, 0, 0, 0};
  made.splats[3].scale[2] = 1e20;
  made.splats[4].coefficient[0] = std::numeric_limits<double>::infinity();
  made.splats[5].sh[4] = std::numeric_limits<double>::quiet_NaN();  // becomes 0
  const maq::Splats splats = read(made.ply());
  ASSERT_EQ(splats.count(), 3u);
  EXPECT_EQ(splats.sh[4], 0);
  EXPECT_EQ(splats.sh.size(), 27u);
}

TEST_F(SplatFiles, OpaqueAndFlatWithoutLimitAreRead) {
  MadeSplats made = made_splats(2, 0);
  made.splats[0].opacity = 1;   // an infinite logit
  made.splats[1].scale[0] = 0;  // a logarithm of minus infinity
  const maq::Splats splats = read(made.ply());
  ASSERT_EQ(splats.count(), 2u);
  EXPECT_EQ(splats.opacity[0], 1);
  EXPECT_EQ(splats.scale[3], 0);
}

TEST_F(SplatFiles, AFileWithNothingToShowIsRefused) {
  MadeSplats made = made_splats(1, 0);
  made.splats[0].rotation = {0, 0, 0, 0};
  expect_refused(made.ply(), "no splat");
  expect_refused(made_splats(0, 0).ply(), "no splat");
  EXPECT_NO_THROW(read_spz(made_splats(1, 0).spz()));
  std::vector<uint8_t> none = made_splats(1, 0).spz();
  none[8] = 0;
  expect_refused(compressed(none), "no splats");
}

TEST_F(SplatFiles, OtherFilesAreRefusedWithTheirRemedy) {
  expect_refused(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n1 2 3\n",
      "Build a scene", MAQ_ERROR_UNSUPPORTED);
  expect_refused(
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uint packed_position\nend_header\n1234",
      "splat-transform", MAQ_ERROR_UNSUPPORTED);
  expect_refused("ply\nformat ascii 1.0\nend_header\n", "no vertices");
  expect_refused("NGSP\x04", "splat-transform", MAQ_ERROR_UNSUPPORTED);
  expect_refused("\x1f\x8b something else", "damaged");
  expect_refused("glTF", "neither");
  expect_refused("", "neither");
  std::string of_degree_2 = made_splats(1, 2).ply("ascii");
  of_degree_2.replace(of_degree_2.find("f_rest_23"), 9, "f_last_23");
  expect_refused(of_degree_2, "f_rest_", MAQ_ERROR_UNSUPPORTED);
  for (const uint32_t version : {0u, 1u, 4u, 0xffffffffu}) {
    expect_refused(compressed(made_splats(1, 0).spz(version)), "version", MAQ_ERROR_UNSUPPORTED);
  }
  expect_refused(compressed(std::vector<uint8_t>(64, 7)), "NGSP");
}

TEST_F(SplatFiles, CountsAreComparedWithTheBytesThatAreThere) {
  const MadeSplats made = made_splats(3, 0);
  // Memory for 30 million splats would be gigabytes.
  expect_refused(compressed(made.spz(3, 29'999'999)), "claims 29999999");
  expect_refused(compressed(made.spz(3, 30'000'001)), "over the limit", MAQ_ERROR_UNSUPPORTED);
  expect_refused(compressed(made.spz(3, 4)), "ends early");
  expect_refused(compressed(made.spz(3, 3, 5)), "damaged");
  std::string ply = made.ply();
  ply.replace(ply.find("vertex 3"), 8, "vertex 9000000000000");
  expect_refused(ply, "claims");
}

TEST_F(SplatFiles, AZeroBombIsNotDecompressedFartherThanItsHeadSays) {
  std::vector<uint8_t> bytes = made_splats(2, 0).spz();
  bytes.resize(bytes.size() + (64 << 20));
  EXPECT_EQ(read_spz(bytes).count(), 2u);
}

TEST_F(SplatFiles, EveryTruncatedOrChangedFileIsASentenceOrFiniteSplats) {
  const MadeSplats made = made_splats(3, 1);
  std::mt19937 random(3);
  size_t refused = 0, accepted = 0;
  const auto check = [&](const std::string& bytes) {
    try {
      const maq::Splats splats = read(bytes);
      ++accepted;
      for (const auto* numbers : {&splats.position, &splats.scale, &splats.rotation, &splats.opacity, &splats.colour}) {
        for (const float value : *numbers) ASSERT_TRUE(std::isfinite(value));
      }
      ASSERT_EQ(splats.sh.size(), 3 * size_t(maq::sh_terms(splats.sh_degree)) * splats.count());
    } catch (const maq::Error& error) {
      ++refused;
      const std::string text = error.what();
      ASSERT_EQ(text.back(), '.') << text;
      ASSERT_NE(error.status(), MAQ_ERROR_INTERNAL) << text;
    }
  };
  for (const std::string& file : {made.ply(), made.ply("ascii"), compressed(made.spz(2)), compressed(made.spz(3))}) {
    for (size_t length = 0; length < file.size(); length += 1 + length / 40) check(file.substr(0, length));
    for (int i = 0; i < 400; ++i) {
      std::string changed = file;
      for (unsigned k = 0; k <= random() % 3; ++k) changed[random() % changed.size()] = char(random());
      check(changed);
    }
  }
  EXPECT_GT(refused, 200u);
  EXPECT_GT(accepted, 200u);
}

// One that has been read, with harmonics and a fit's odd numbers.
MadeSplats to_write() {
  MadeSplats made = made_splats(50, 2, 9, 3, {100, -20, 7});
  made.splats[3].opacity = 0.9999999;
  return made;
}

TEST_F(SplatFiles, WrittenPlyAndSpzFilesAreReadAgain) {
  const MadeSplats made = to_write();
  const maq::Splats splats = read(made.ply());
  maq::write_splat_file(splats, folder_.file("again.PLY"));
  expect_near(maq::read_splat_file(folder_.file("again.PLY")), made, 2e-5, 1e-5, 1e-5, 1e-6, 1e-5, 1.3e-4);
  maq::write_splat_file(splats, folder_.file("again.spz"));
  expect_near(maq::read_splat_file(folder_.file("again.spz")), made, 1.6e-5, 0.033, 4e-3, 2e-3, 4e-3, 4.1e-3);
}

TEST_F(SplatFiles, PositionsInAnSpzFileUseAllOfItsBits) {
  for (const double size : {1e-3, 1.0, 1000.0, 1e6}) {
    const MadeSplats made = made_splats(20, 0, 2, size);
    maq::write_splat_file(read(made.ply()), folder_.file("sized.spz"));
    const maq::Splats splats = maq::read_splat_file(folder_.file("sized.spz"));
    for (size_t i = 0; i < splats.position.size(); ++i) {
      const double found = splats.origin[i % 3] + double(splats.position[i]);
      EXPECT_NEAR(found, made.splats[i / 3].position[i % 3], std::max(1.6e-7 * size, 8e-6));
    }
  }
  const maq::Splats far = read(made_splats(2, 0, 2, 1, {1e7, 0, 0}).ply());
  expect_error(MAQ_ERROR_UNSUPPORTED, ".ply", [&] { maq::write_splat_file(far, folder_.file("far.spz")); });
  EXPECT_FALSE(std::filesystem::exists(folder_.file("far.spz")));
}

TEST_F(SplatFiles, AFlagOfAntialiasingIsKept) {
  maq::Splats splats = read(made_splats(2, 0).ply());
  EXPECT_FALSE(splats.is_antialiased);
  splats.is_antialiased = true;
  for (const char* name : {"flag.ply", "flag.spz"}) {
    maq::write_splat_file(splats, folder_.file(name));
    EXPECT_TRUE(maq::read_splat_file(folder_.file(name)).is_antialiased) << name;
  }
}

TEST_F(SplatFiles, AGlbFileHasTheAttributesOfTheExtension) {
  const MadeSplats made = to_write();
  const std::vector<uint8_t> bytes = maq::glb_of(read(made.ply()));
  uint32_t json_bytes = 0;
  std::memcpy(&json_bytes, bytes.data() + 12, sizeof json_bytes);
  const nlohmann::json gltf = nlohmann::json::parse(bytes.begin() + 20, bytes.begin() + 20 + json_bytes);
  const auto& primitive = gltf["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_EQ(primitive["extensions"]["KHR_gaussian_splatting"]["kernel"], "ellipse");
  EXPECT_EQ(primitive["attributes"].size(), 6u + 3 + 5);
  for (const auto& [name, accessor] : primitive["attributes"].items()) {
    EXPECT_EQ(gltf["accessors"][accessor.get<size_t>()]["count"], 50) << name;
  }
  const auto floats = [&](const std::string& name) {
    const auto& view = gltf["bufferViews"][primitive["attributes"]["KHR_gaussian_splatting:" + name].get<size_t>()];
    std::vector<float> values(view["byteLength"].get<size_t>() / sizeof(float));
    std::memcpy(values.data(), bytes.data() + 28 + json_bytes + view["byteOffset"].get<size_t>(),
                values.size() * sizeof(float));
    return values;
  };
  EXPECT_NEAR(double(floats("SCALE")[4]), made.splats[1].scale[1], 1e-5);
  EXPECT_NEAR(double(floats("ROTATION")[3]), made.splats[0].rotation[0], 1e-6);
  EXPECT_NEAR(double(floats("OPACITY")[2]), made.splats[2].opacity, 1e-6);
  EXPECT_NEAR(double(floats("SH_DEGREE_0_COEF_0")[5]), made.splats[1].coefficient[2], 1e-5);
  EXPECT_NEAR(double(floats("SH_DEGREE_2_COEF_1")[4]), made.splats[1].sh[3 * 4 + 1], 1.3e-4);
}

}  // namespace
