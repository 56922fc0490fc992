#include "body/model/body_bundle.h"

#include "body/model/body_file.h"

namespace maq::body {

std::shared_ptr<const BodyModel> model_of_bundle(const Bundle& bundle) {
  bundle.manifest.require_task("body");
  const std::string name = bundle.manifest.listed_file(bundle.manifest.root.at("body").at("file"));
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  return std::make_shared<const BodyModel>(read_body(bytes.data(), bytes.size(), bundle.path_of(name)));
}

}  // namespace maq::body
