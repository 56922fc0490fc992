// Bundles whose transformer is not what it should be, and files of rows that are damaged or made to do harm.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/samples/tiny_transformer.h"

namespace {

using nlohmann::json;
using tiny_transformer::kBundle;

class TransformerBundles : public testing::Test {
 protected:
  TransformerBundles() { std::filesystem::copy(kBundle, folder_.path(), std::filesystem::copy_options::recursive); }
  void expect_refused(const json& manifest, const char* text) const {
    write_text(folder_.file("manifest.json"), manifest.dump());
    expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { tiny_transformer::open(folder_.path().string()); });
  }

  TempFolder folder_;
  const json manifest_ = json::parse(read_text(kBundle + "/manifest.json"));
};

TEST_F(TransformerBundles, WithoutWhatIsReadAreRefused) {
  EXPECT_NO_THROW(tiny_transformer::open(folder_.path().string()));
  json changed = manifest_;
  for (const char* key : {"file", "fps"}) {
    changed = manifest_;
    changed["transformer"].erase(key);
    expect_refused(changed, key);
  }
  for (const json& range : {json{30, 10}, json{0, 10}, json{10}, json{"a", "b"}}) {
    changed = manifest_;
    changed["transformer"]["fps"] = range;
    expect_refused(changed, "fps");
  }
  changed = manifest_;
  changed["transformer"]["file"] = "codes.maqc";
  expect_refused(changed, "which holds the codes");
  changed["transformer"]["file"] = "encoder.onnx";
  expect_refused(changed, "is not a file of rows");
}

TEST_F(TransformerBundles, WithOtherGraphsAreRefused) {
  for (const char* graph : {"context", "slices", "head_0", "head_1"}) {
    json changed = manifest_;
    changed["graphs"].erase(graph);
    expect_refused(changed, graph);
    for (const char* side : {"inputs", "outputs"}) {
      for (size_t i = 0; i < manifest_["graphs"][graph][side].size(); ++i) {
        changed = manifest_;
        changed["graphs"][graph][side][i]["name"] = "other";
        expect_refused(changed, graph);
        changed = manifest_;
        changed["graphs"][graph][side][i]["shape"].back() = 99;
        expect_refused(changed, graph);
      }
      changed = manifest_;
      changed["graphs"][graph][side].erase(0);
      expect_refused(changed, graph);
    }
  }
}

void use_rows(const void* bytes, size_t count) {
  const maq::TransformerTables tables = maq::read_embedding_file(bytes, count, "transformer.maqr");
  std::vector<float> sum(tables.cells() * tables.embedding), near(maq::kNearCodes * tables.embedding),
      earlier(tables.width);
  const std::vector<uint16_t> last(tables.cells() * tables.groups, uint16_t(tables.entries - 1));
  maq::ContextFrames frames{};
  for (size_t frame = 0; frame < tables.frames; ++frame) frames[frame] = last.data();
  maq::sum_context_embeddings(tables, frames, sum.data());
  maq::GroupEmbeddings rows(tables);
  for (size_t cell = 0; cell < tables.cells(); ++cell) {
    rows.set(cell, last.data());
    rows.near(cell, near.data());
  }
  for (size_t of = 0; of < tables.groups; ++of) maq::sum_earlier_embeddings(tables, of, last.data(), earlier.data());
}

TEST_F(TransformerBundles, RowsThatAreDamagedOrMadeToDoHarmAreRefusedOrHarmless) {
  for (const std::string& file : {kBundle + "/transformer.maqr", tiny_transformer::kFolder + "/rows_in_bytes.maqr"}) {
    const std::string whole = read_text(file);
    std::mt19937 random(2);
    for (int i = 0; i < 300; ++i) {
      std::string bytes = whole;
      const size_t at = i < 72 ? size_t(i) : random() % bytes.size();
      bytes[at] = char(bytes[at] ^ (1 << random() % 8));
      ASSERT_TRUE(checked_file_damage::is_refused(bytes, MAQ_ERROR_BAD_BUNDLE, use_rows)) << at;
      ASSERT_TRUE(checked_file_damage::is_refused(whole.substr(0, at), MAQ_ERROR_BAD_BUNDLE, use_rows)) << at;
    }
    checked_file_damage::expect_random_changes_harmless(whole, 72, 500, MAQ_ERROR_BAD_BUNDLE, use_rows);
  }
}

TEST_F(TransformerBundles, RowsInBytesAreNearThoseInFloats) {
  const std::string wide = read_text(kBundle + "/transformer.maqr"),
                    narrow = read_text(tiny_transformer::kFolder + "/rows_in_bytes.maqr");
  const maq::TransformerTables one = maq::read_embedding_file(wide.data(), wide.size(), "one"),
                               other = maq::read_embedding_file(narrow.data(), narrow.size(), "other");
  ASSERT_EQ(one.context_embeddings.size(), other.context_embeddings.size());
  for (size_t row = 0; row < one.context_embeddings.size(); row += one.embedding) {
    float largest = 0;
    for (size_t i = row; i < row + one.embedding; ++i) largest = std::max(largest, std::abs(one.context_embeddings[i]));
    for (size_t i = row; i < row + one.embedding; ++i) {
      ASSERT_NEAR(one.context_embeddings[i], other.context_embeddings[i], largest / 254 * 1.001f) << i;
    }
  }
  EXPECT_EQ(one.row_bias, other.row_bias);
}

}  // namespace
