#include "nn/manifest_node.h"

#include <cmath>
#include <cstdint>

namespace maq {

using nlohmann::json;

ManifestNode ManifestNode::parse(const std::string& text, const std::string& origin) {
  constexpr char kAdvice[] = ". Fetch or export the bundle again.";
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 3, column 9: …"; also for numbers that a double cannot
    // hold. The text quotes the value, however long it is.
    constexpr size_t kMaxBytes = 200;
    std::string what = error.what();
    what = what.substr(what.find(']') + 2);
    if (what.size() > kMaxBytes) {
      what.resize(kMaxBytes);
      while (!what.empty() && uint8_t(what.back()) >= 0x80) what.pop_back();  // a part of a character
      what += "...";
    }
    throw Error(MAQ_ERROR_BAD_BUNDLE, origin, " is not a JSON object: ", what, kAdvice);
  }
  if (!root.is_object()) throw Error(MAQ_ERROR_BAD_BUNDLE, origin, " is not a JSON object", kAdvice);
  const auto document = std::make_shared<const Document>(Document{std::move(root), origin});
  return {document, document->root, ""};
}

ManifestNode ManifestNode::at(const std::string& key) const {
  const std::string path = path_.empty() ? key : path_ + "." + key;
  if (!value_->is_object() || !value_->contains(key)) ManifestNode(document_, *value_, path).fail("is missing");
  return {document_, value_->at(key), path};
}

std::optional<ManifestNode> ManifestNode::find(const std::string& key) const {
  if (value_->is_object() && !value_->contains(key)) return std::nullopt;
  return at(key);
}

std::vector<ManifestNode> ManifestNode::elements() const {
  if (!value_->is_array()) fail("is not a list");
  std::vector<ManifestNode> nodes;
  for (size_t i = 0; i < value_->size(); ++i) {
    nodes.push_back(ManifestNode(document_, (*value_)[i], path_ + "[" + std::to_string(i) + "]"));
  }
  return nodes;
}

std::vector<std::pair<std::string, ManifestNode>> ManifestNode::members() const {
  if (!value_->is_object()) fail("is not an object");
  std::vector<std::pair<std::string, ManifestNode>> nodes;
  for (const auto& [key, value] : value_->items()) {
    nodes.emplace_back(key, ManifestNode(document_, value, path_ + "." + key));
  }
  return nodes;
}

std::string ManifestNode::text() const {
  constexpr size_t kMaxBytes = 1000;  // limit for names, which errors quote
  if (!value_->is_string()) fail("is not a text");
  const auto text = value_->get<std::string>();
  if (text.size() > kMaxBytes) fail("has ", text.size(), " bytes, but must have at most ", kMaxBytes);
  return text;
}

float ManifestNode::number(double min, double max) const {
  if (!value_->is_number()) fail("is not a number");
  const double number = value_->get<double>();
  if (!std::isfinite(number) || number < min || number > max) {
    fail("is ", number, ", but must be ", min, " to ", max);
  }
  return float(number);
}

int ManifestNode::integer(int min, int max) const {
  if (!value_->is_number_integer()) fail("is not a whole number");
  return int(number(min, max));
}

int64_t ManifestNode::size() const {
  if (!value_->is_number_unsigned()) fail("is not a whole number of 0 or more");
  const auto size = value_->get<uint64_t>();
  if (size > uint64_t(INT64_MAX)) fail("is ", size, ", more than any file has");
  return int64_t(size);
}

}  // namespace maq
