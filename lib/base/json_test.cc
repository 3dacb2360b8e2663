#include "sextant/base/json.h"

#include <string>

#include "sextant/base/testing.h"

namespace sextant {
namespace {

std::string parse_error(const std::string& text) {
  return error_of([&] { parse_json(text, "f.json"); });
}

std::string nested(size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); }

TEST(ParseJson, IsWhatTheLibraryReads) {
  const std::string text =
      R"( {"b":[1,-2,2.5,true,null,"\u0394\n",{"a":{}},[]],"a":18446744073709551615,
           "c":-9223372036854775808} )";
  EXPECT_EQ(parse_json(text, "f"), Json::parse(text));  // the library's parser
  EXPECT_EQ(json_line(parse_json(text, "f")), Json::parse(text).dump());
  EXPECT_EQ(parse_json("3", "f"), Json(3));
}

TEST(ParseJson, ErrorsNameFileAndLine) {
  EXPECT_EQ(parse_error("{\n\"a\": 1,\n}"), "f.json:3: not valid JSON at column 1, near '}'");
  EXPECT_EQ(parse_error("{\"a\": nan}"), "f.json:1: not valid JSON at column 8, near 'an}'");
  EXPECT_THAT(parse_error(""), HasSubstr("f.json:1: not valid JSON"));
  EXPECT_THAT(parse_error("{\"a\":"), HasSubstr("ends too early"));
  EXPECT_THAT(parse_error("{} {}"), HasSubstr("f.json:1: not valid JSON at column 4"));
  EXPECT_THAT(parse_error("\"\xff\""), HasSubstr("not valid JSON"));
  EXPECT_THAT(parse_error("{\"a\"\n:\n\x1b[2J"), Not(HasSubstr("\x1b")));
}

TEST(ParseJson, NumbersBeyondADoubleAreRefused) {
  EXPECT_EQ(parse_error("{\n\"a\": 1e400}"), "f.json:2: the number 1e400 is outside the range of a double");
  EXPECT_EQ(parse_error("[-1e400]"), "f.json:1: the number -1e400 is outside the range of a double");
}

TEST(ParseJson, AKeyThatIsThereTwiceIsRefused) {
  EXPECT_EQ(parse_error("{\"a\": 1,\n\"b\": {\"a\": 2}, \"a\": 3}"), "f.json:2: key 'a' is repeated");
}

TEST(ParseJson, ManyKeysTakeLinearTime) {
  std::string text = "{";
  for (int i = 0; i < 200'000; ++i) text += fmt::format("\"key {}\":{},", i, i);
  const Json json = parse_json(text + "\"last\":{}}", "f");
  EXPECT_EQ(json.size(), 200'001U);
  EXPECT_EQ(json.at("key 7"), 7);
  EXPECT_EQ(parse_error(text + "\"key 99999\":1}"), "f.json:1: key 'key 99999' is repeated");
}

TEST(ParseJson, DepthIsLimited) {
  EXPECT_EQ(parse_json(nested(max_json_depth), "f").size(), 1U);
  EXPECT_EQ(parse_error("\n" + nested(max_json_depth + 1)),
            "f.json:2: more than 100 levels of objects and lists");
  EXPECT_THAT(parse_error(std::string(1000000, '[')), HasSubstr("more than 100 levels"));
  EXPECT_FALSE(try_parse_json(nested(100000)));
}

TEST(JsonMember, ErrorsNameFileAndKey) {
  const Json json = parse_json(R"({"text":"a","number":1.5,"whole":-3,"big":18446744073709551615})", "f");
  EXPECT_EQ(json_member<std::string>(json, "text", "f"), "a");
  EXPECT_EQ(json_member<double>(json, "whole", "f"), -3);
  EXPECT_EQ(json_member<int>(json, "other", "f", 7), 7);
  EXPECT_EQ(json_member<uint64_t>(json, "big", "f"), 18446744073709551615U);
  EXPECT_EQ(error_of([&] { json_member<std::string>(json, "number", "f"); }),
            "f: key 'number': expected a text, got 1.5");
  EXPECT_EQ(error_of([&] { json_member<int>(json, "number", "f", 7); }),
            "f: key 'number': expected an integer, got 1.5");
  EXPECT_EQ(error_of([&] { json_member<int>(json, "other", "f"); }), "f: key 'other' is missing");
  EXPECT_EQ(error_of([&] { json_member<int64_t>(json, "big", "f"); }),
            "f: key 'big': expected a 64-bit integer, got 18446744073709551615");
  EXPECT_EQ(error_of([&] { json_member<uint64_t>(json, "whole", "f"); }),
            "f: key 'whole': expected a non-negative integer, got -3");
  EXPECT_EQ(error_of([&] { json_object(json, "text", "f"); }),
            "f: key 'text': expected an object, got \"a\"");
  EXPECT_EQ(error_of([&] { json_member<int>(Json(3), "a", "f"); }), "f: expected an object, got 3");
  EXPECT_TRUE(json_list(json, "other", "f").empty());
}

TEST(JsonText, DirectionsAreEscapedAndReadBackTheSame) {
  const Json json = {{"a\u202e", "\u2066b\u2069 \u0394"}};
  EXPECT_EQ(json_line(json), "{\"a\\u202E\":\"\\u2066b\\u2069 \u0394\"}");
  EXPECT_EQ(parse_json(json_text(json), "f"), json);
}

TEST(JsonText, HoldsAnyBytesAndExcerptsAreShort) {
  EXPECT_EQ(json_line(Json("a\xff")), "\"a\uFFFD\"");
  EXPECT_EQ(json_text(Json{{"a", 1}}), "{\n  \"a\": 1\n}\n");
  EXPECT_LT(json_excerpt(Json(std::string(1000, 'x'))).size(), 100U);
}

}  // namespace
}  // namespace sextant
