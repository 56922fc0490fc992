#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/json/json_text.h"
#include "core/json/json_value.h"

namespace {

using maq::JsonText;
using maq::JsonValue;

TEST(Json, ReadsEveryKindOfValue) {
  const JsonValue root =
      JsonValue::parse(R"({"list": [1, -2, 2.5, 1e30, true, null, "a\u00e9"], "b": {"c": "d"}, "b2": 1,
      "twice": 1, "twice": 2})");
  const JsonValue::List& list = *root.find("list")->list();
  ASSERT_EQ(list.size(), 7u);
  EXPECT_EQ(*list[0].size(), 1u);
  EXPECT_TRUE(list[1].is_whole());
  EXPECT_EQ(list[1].size(), nullptr);
  EXPECT_EQ(list[1].number(), -2);
  EXPECT_FALSE(list[2].is_whole());
  EXPECT_EQ(list[2].number(), 2.5);
  EXPECT_EQ(list[3].number(), 1e30);
  EXPECT_TRUE(*list[4].flag());
  EXPECT_FALSE(list[4].number());
  EXPECT_EQ(list[5].text(), nullptr);
  EXPECT_EQ(*list[6].text(), "a\u00e9");
  EXPECT_EQ(*root.find("b")->find("c")->text(), "d");
  EXPECT_EQ(root.find("c"), nullptr);
  EXPECT_EQ(list[0].find("c"), nullptr);
  EXPECT_EQ(root.find("twice")->number(), 2);
  EXPECT_EQ(root.object()->size(), 4u);
}

TEST(Json, SaysWhereTextIsNoJsonAndRefusesDeepNesting) {
  const auto fault = [](const std::string& text) -> std::string {
    try {
      JsonValue::parse(text);
      return "";
    } catch (const maq::JsonError& error) {
      return error.what();
    }
  };
  EXPECT_NE(fault("{\n  \"a\": !}").find("line 2, column 8"), std::string::npos) << fault("{\n  \"a\": !}");
  EXPECT_NE(fault("[1e400]").find("1e400"), std::string::npos);
  EXPECT_NE(fault(""), "");
  EXPECT_NE(fault("[\"\xff\"]"), "");
  EXPECT_EQ(fault(std::string(100, '[') + std::string(100, ']')), "");
  EXPECT_NE(fault(std::string(101, '[') + std::string(101, ']')).find("100 levels"), std::string::npos);
  EXPECT_NE(fault(std::string(1000000, '[')).find("100 levels"), std::string::npos);
}

// Files keep the layout that they had when nlohmann/json wrote them.
TEST(Json, WritesTheLayoutOfNlohmannJson) {
  const nlohmann::ordered_json wanted = {{"empty", nlohmann::json::array()},
                                         {"none", nlohmann::ordered_json::object()},
                                         {"numbers", {0.0, -0.0, 0.1, 1e-5, 1e22, 123456789.125, double(0.1f), 3}},
                                         {"nested", {{{"a", nullptr}}, {{"b", {true, false}}}}},
                                         {"text", "quote \" slash \\ line\n\u00e9"}};
  for (const int indent : {-1, 1, 2}) {
    JsonText text(indent);
    text.begin_object().key("empty").begin_list().end_list().key("none").begin_object().end_object();
    text.key("numbers").begin_list();
    for (const double number : {0.0, -0.0, 0.1, 1e-5, 1e22, 123456789.125, double(0.1f)}) text.value(number);
    text.value(3).end_list().key("nested").begin_list().begin_object().key("a").null().end_object();
    text.begin_object().key("b").begin_list().value(true).value(false).end_list().end_object().end_list();
    text.member("text", "quote \" slash \\ line\n\u00e9").end_object();
    EXPECT_EQ(text.text(), wanted.dump(indent));
  }
  EXPECT_EQ(JsonText().value(std::string("a\xff")).text(), "\"a\ufffd\"");
}

}  // namespace
