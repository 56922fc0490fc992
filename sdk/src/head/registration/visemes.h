// The 15 visemes of Oculus Lipsync, which lip-sync programs drive, from facial actions.
#pragma once

#include <vector>

#include "head/head_template.h"

namespace maq::head {

// viseme_sil, viseme_PP, … viseme_U, as Ready Player Me names them; none unless the template has every facial action
// that they are made of.
std::vector<FacialAction> visemes_of(const HeadTemplate& head);

}  // namespace maq::head
