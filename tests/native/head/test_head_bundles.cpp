// Bundles for heads that are not what they should be.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nn/sha256.h"
#include "support/expect_error.h"
#include "support/samples/tiny_head.h"

namespace head_bundles {
namespace {

using nlohmann::json;

class HeadBundles : public testing::Test {
 protected:
  HeadBundles() { std::filesystem::copy(tiny_head::kBundle, folder_.path(), std::filesystem::copy_options::recursive); }

  void open() const { maq::head::HeadBundle(maq::read_bundle(folder_.path().string())); }
  void expect_refused(const json& manifest, maq_status status, const char* text) const {
    write_text(folder_.file("manifest.json"), manifest.dump());
    expect_error(status, text, [&] { open(); });
  }
  // With another prior, whose size and digest the manifest has.
  json with_prior(const std::string& bytes) const {
    write_text(folder_.file("prior.maqp"), bytes);
    json changed = manifest_;
    changed["files"]["prior.maqp"] = {{"sha256", maq::sha256_hex(bytes.data(), bytes.size())}, {"bytes", bytes.size()}};
    return changed;
  }

  TempFolder folder_;
  const json manifest_ = json::parse(read_text(tiny_head::kBundle + "/manifest.json"));
};

TEST_F(HeadBundles, HaveTheEncodersSizesAndThePrior) {
  const maq::head::HeadBundle bundle(maq::read_bundle(folder_.path().string()));
  EXPECT_EQ(bundle.encoder.crop_px(), 32);
  EXPECT_EQ(bundle.encoder.cells.side, 8);
  EXPECT_EQ(bundle.encoder.cells.cell_px, 4);
  EXPECT_FLOAT_EQ(float(bundle.encoder.crop_sides), 1.6f);
  EXPECT_EQ(bundle.prior.anchors.count(), 7u);
  EXPECT_EQ(bundle.prior.shape_codes(), 3);
  EXPECT_EQ(bundle.bundle.files.count("prior.maqp"), 0u);
  std::string digest;
  for (const uint8_t byte : bundle.prior_sha256) {
    for (const int digit : {byte >> 4, byte & 15}) digest += "0123456789abcdef"[digit];
  }
  EXPECT_EQ(manifest_["files"]["prior.maqp"]["sha256"], digest);
}

TEST_F(HeadBundles, MayHaveATemplateHead) {
  EXPECT_EQ(maq::head::HeadBundle(maq::read_bundle(folder_.path().string())).template_head, nullptr);
  const std::string bytes = read_text(tiny_head::kFolder + "/template.maqt");
  write_text(folder_.file("template.maqt"), bytes);
  json changed = manifest_;
  const auto describe = [&](const std::string& content) {
    changed["files"]["template.maqt"] = {{"sha256", maq::sha256_hex(content.data(), content.size())},
                                         {"bytes", content.size()}};
  };
  describe(bytes);
  changed["template"] = {{"file", "template.maqt"}};
  write_text(folder_.file("manifest.json"), changed.dump());
  const maq::head::HeadBundle bundle(maq::read_bundle(folder_.path().string()));
  ASSERT_NE(bundle.template_head, nullptr);
  EXPECT_EQ(bundle.template_head->actions.size(), 2u);
  EXPECT_EQ(bundle.bundle.files.count("template.maqt"), 0u);
  changed["template"]["file"] = "another.maqt";
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "template.file");
  changed["template"] = json::object();
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "template");
  changed["template"] = {{"file", "template.maqt"}};
  const std::string cut = bytes.substr(0, bytes.size() - 1);
  write_text(folder_.file("template.maqt"), cut);
  describe(cut);
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "truncated or damaged");
}

TEST_F(HeadBundles, OfAnotherTaskOrWithoutWhatIsReadAreRefused) {
  json changed = manifest_;
  changed["task"] = "edges";
  expect_refused(changed, MAQ_ERROR_UNSUPPORTED, "edges");
  for (const char* key : {"encoder", "prior"}) {
    changed = manifest_;
    changed.erase(key);
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, key);
  }
  changed = manifest_;
  changed["graphs"].erase("encoder");
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "graphs.encoder");
  const auto with = [&](const char* key, const json& value) {
    json made = manifest_;
    made["encoder"][key] = value;
    return made;
  };
  for (const json& value : {json(0), json(-32), json(2048), json("32"), json(32.5), json(34)}) {
    expect_refused(with("crop_px", value), MAQ_ERROR_BAD_BUNDLE, "encoder.crop_px");
  }
  for (const json& value : {json(0), json(65), json(nullptr)}) {
    expect_refused(with("cell_px", value), MAQ_ERROR_BAD_BUNDLE, "encoder.cell_px");
  }
  for (const json& value : {json(0), json(0.5), json(9), json("1.6")}) {
    expect_refused(with("crop_sides", value), MAQ_ERROR_BAD_BUNDLE, "encoder.crop_sides");
  }
  const json face = {{"center_dm", {0, -1.24, -0.35}}, {"radius_dm", 0.95}, {"crop_sides", 1.3}};
  for (const auto& [key, value] : {std::pair<const char*, json>{"center_dm", {0, -1.24}},
                                   {"center_dm", {0, -5, 0}},
                                   {"radius_dm", 0},
                                   {"radius_dm", "1"},
                                   {"crop_sides", 0.9},
                                   {"crop_sides", nullptr}}) {
    json made = face;
    made[key] = value;
    expect_refused(with("face", made), MAQ_ERROR_BAD_BUNDLE, (std::string("encoder.face.") + key).c_str());
  }
  expect_refused(with("face", 1), MAQ_ERROR_BAD_BUNDLE, "encoder.face");
  changed = manifest_;
  changed["prior"]["file"] = "../prior.maqp";
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "prior.file");
}

TEST_F(HeadBundles, WithAnotherGraphAreRefused) {
  for (const auto& [side, text] :
       {std::pair{"inputs", "the input image [1, 32, 32, 3]"}, {"outputs", "the output cells [1, 8, 8, 8]"}}) {
    for (const auto& [key, value] : {std::pair<std::string, json>{"name", "other"},
                                     {"shape", {1, 32, 32, 7}},
                                     {"shape", {1, 12}},
                                     {"shape", {1, "height", "width", 3}}}) {
      json changed = manifest_;
      changed["graphs"]["encoder"][side][0][key] = value;
      expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, text);
    }
    json changed = manifest_;
    json& tensors = changed["graphs"]["encoder"][side];
    tensors.push_back(tensors[0]);
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, text);
  }
  json changed = manifest_;
  changed["encoder"]["cell_px"] = 8;
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "cells [1, 4, 4, 8]");
}

TEST_F(HeadBundles, WithADamagedFileAreRefusedAlsoWhereItsDigestIsRight) {
  const std::string prior = read_text(folder_.file("prior.maqp"));
  std::string damaged = prior;
  damaged[300] = char(damaged[300] ^ 1);
  expect_refused(with_prior(damaged), MAQ_ERROR_BAD_BUNDLE, "prior.maqp is damaged");
  expect_refused(with_prior(prior.substr(0, 100)), MAQ_ERROR_BAD_BUNDLE, "prior.maqp is too short");
  damaged = prior;
  damaged[8] = 2;
  expect_refused(with_prior(damaged), MAQ_ERROR_UNSUPPORTED, "version 2");
  write_text(folder_.file("prior.maqp"), damaged);
  expect_refused(manifest_, MAQ_ERROR_BAD_BUNDLE, "SHA-256");
  std::filesystem::remove(folder_.file("prior.maqp"));
  expect_refused(manifest_, MAQ_ERROR_BAD_BUNDLE, "is missing");
}

}  // namespace
}  // namespace head_bundles
