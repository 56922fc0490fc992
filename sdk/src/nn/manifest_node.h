// A value in a manifest that is read with its path, which each error names: "rpn.strides[2]".
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/json/json_value.h"

namespace maq {

// Keeps the document alive, so a node outlives the manifest that it came from. Every getter throws MAQ_ERROR_BAD_BUNDLE
// for a value that is missing, of another type or out of range.
class ManifestNode {
 public:
  // The root of a document. `origin` names the file in errors. Throws MAQ_ERROR_BAD_BUNDLE for text that is not a JSON
  // object.
  static ManifestNode parse(const std::string& text, const std::string& origin);

  // Throws MAQ_ERROR_BAD_BUNDLE: the file, the path, then the fault.
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(MAQ_ERROR_BAD_BUNDLE, document_->origin, ": \"", path_, "\" ", parts...,
                ". Fetch or export the bundle again.");
  }

  ManifestNode at(const std::string& key) const;
  // For a key that may be missing.
  std::optional<ManifestNode> find(const std::string& key) const;
  std::vector<ManifestNode> elements() const;
  std::vector<std::pair<std::string, ManifestNode>> members() const;

  std::string text() const;
  float number(double min, double max) const;
  int integer(int min, int max) const;
  int64_t size() const;  // 0 or more
  template <size_t count>
  std::array<float, count> numbers(double min, double max) const {
    const std::vector<ManifestNode> nodes = elements();
    if (nodes.size() != count) fail("has ", nodes.size(), " entries, but must have ", count);
    std::array<float, count> result{};
    for (size_t i = 0; i < count; ++i) result[i] = nodes[i].number(min, max);
    return result;
  }
  bool is_text() const { return value_->text() != nullptr; }

 private:
  struct Document {
    JsonValue root;
    std::string origin;
  };

  ManifestNode(std::shared_ptr<const Document> document, const JsonValue& value, std::string path)
      : document_(std::move(document)), value_(&value), path_(std::move(path)) {}

  std::shared_ptr<const Document> document_;
  const JsonValue* value_;  // in the document
  std::string path_;
};

}  // namespace maq
