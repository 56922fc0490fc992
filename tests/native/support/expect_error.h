// Expecting a maq::Error of a status whose sentence contains a text.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "core/error.h"

template <class Body>
void expect_error(maq_status status, const std::string& part_of_text, Body&& body) {
  try {
    body();
    ADD_FAILURE() << "no error, but status " << status << " with \"" << part_of_text << "\" was expected";
  } catch (const maq::Error& error) {
    EXPECT_EQ(error.status(), status) << error.what();
    EXPECT_NE(std::string(error.what()).find(part_of_text), std::string::npos) << error.what();
  }
}
