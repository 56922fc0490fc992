#include "nn/manifest_node.h"

#include <cmath>
#include <cstdint>

namespace maq {

ManifestNode ManifestNode::parse(const std::string& text, const std::string& origin) {
  constexpr char kAdvice[] = ". Fetch or export the bundle again.";
  const auto document = std::make_shared<Document>(Document{{}, origin});
  try {
    document->root = JsonValue::parse(text);
  } catch (const JsonError& error) {
    constexpr size_t kMaxBytes = 200;  // the text quotes the value, however long it is
    std::string what = error.what();
    if (what.size() > kMaxBytes) {
      what.resize(kMaxBytes);
      while (!what.empty() && uint8_t(what.back()) >= 0x80) what.pop_back();  // a part of a character
      what += "...";
    }
    throw Error(MAQ_ERROR_BAD_BUNDLE, origin, " is not a JSON object: ", what, kAdvice);
  }
  if (document->root.object() == nullptr) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, origin, " is not a JSON object", kAdvice);
  }
  return {document, document->root, ""};
}

ManifestNode ManifestNode::at(const std::string& key) const {
  const std::string path = path_.empty() ? key : path_ + "." + key;
  const JsonValue* const value = value_->find(key);
  if (value == nullptr) ManifestNode(document_, *value_, path).fail("is missing");
  return {document_, *value, path};
}

std::optional<ManifestNode> ManifestNode::find(const std::string& key) const {
  if (value_->object() != nullptr && value_->find(key) == nullptr) return std::nullopt;
  return at(key);
}

std::vector<ManifestNode> ManifestNode::elements() const {
  const JsonValue::List* const list = value_->list();
  if (list == nullptr) fail("is not a list");
  std::vector<ManifestNode> nodes;
  for (size_t i = 0; i < list->size(); ++i) {
    nodes.push_back(ManifestNode(document_, (*list)[i], path_ + "[" + std::to_string(i) + "]"));
  }
  return nodes;
}

std::vector<std::pair<std::string, ManifestNode>> ManifestNode::members() const {
  if (value_->object() == nullptr) fail("is not an object");
  std::vector<std::pair<std::string, ManifestNode>> nodes;
  for (const auto& [key, value] : *value_->object()) {
    nodes.emplace_back(key, ManifestNode(document_, value, path_ + "." + key));
  }
  return nodes;
}

std::string ManifestNode::text() const {
  constexpr size_t kMaxBytes = 1000;  // limit for names, which errors quote
  const std::string* const text = value_->text();
  if (text == nullptr) fail("is not a text");
  if (text->size() > kMaxBytes) fail("has ", text->size(), " bytes, but must have at most ", kMaxBytes);
  return *text;
}

float ManifestNode::number(double min, double max) const {
  const std::optional<double> number = value_->number();
  if (!number) fail("is not a number");
  if (!std::isfinite(*number) || *number < min || *number > max) {
    fail("is ", *number, ", but must be ", min, " to ", max);
  }
  return float(*number);
}

int ManifestNode::integer(int min, int max) const {
  if (!value_->is_whole()) fail("is not a whole number");
  return int(number(min, max));
}

int64_t ManifestNode::size() const {
  const uint64_t* const size = value_->size();
  if (size == nullptr) fail("is not a whole number of 0 or more");
  if (*size > uint64_t(INT64_MAX)) fail("is ", *size, ", more than any file has");
  return int64_t(*size);
}

}  // namespace maq
