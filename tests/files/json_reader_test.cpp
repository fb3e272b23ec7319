#include "engine/files/json_reader.h"
#include "engine/files/json_scan.h"

#include "tests/gltf/glb.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stylet::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

std::string parse_error(const std::string& text, const JsonLimits& limits = {}) {
  try {
    JsonFile file("a.json", text, limits);
    file.root("stylet-test", 1);
  } catch (const ContentError& error) {
    return error.what();
  }
  return "no error";
}

/// Problems of {"format", "version", ...} read by `reader`.
template <typename Reader>
std::vector<std::string> problems_of(const std::string& members, Reader&& reader) {
  JsonFile file("a.json", R"({"format": "stylet-test", "version": 1, )" + members + "}");
  JsonObject root = file.root("stylet-test", 1);
  reader(root);
  root.finish();
  return file.problems();
}

TEST(JsonReader, MissingFileSaysWhichAndWhatToDo) {
  try {
    JsonFile file(std::filesystem::path("/nowhere/a.json"));
    FAIL() << "opened a file that is not there";
  } catch (const ContentError& error) {
    EXPECT_STREQ(error.what(), "/nowhere/a.json: there is no such file; check the path");
  }
}

TEST(JsonReader, FoldersAndDevicesAreNotRead) {
  EXPECT_THROW(JsonFile(std::filesystem::path("/tmp")), ContentError);
  EXPECT_THROW(JsonFile(std::filesystem::path("/dev/zero")), ContentError);
}

TEST(JsonReader, SyntaxErrorGivesLineAndColumn) {
  EXPECT_THAT(parse_error("{\n  \"format\": \"stylet-test\",\n  \"version\" 1\n}"),
              StartsWith("a.json:3:13: not valid JSON"));
  EXPECT_EQ(parse_error(""), "a.json: is empty; copy or export it again");
  EXPECT_EQ(parse_error("{\"a\": NaN}"), "a.json:1:7: NaN is no number in JSON; write a finite number");
  EXPECT_EQ(parse_error("{\"a\": -Infinity}"), "a.json:1:8: Infinity is no number in JSON; write a finite number");
  EXPECT_THAT(parse_error("{\"a\" 1}"), testing::HasSubstr("expected ':'")) << "the end is what helps";
  EXPECT_THAT(parse_error("{\"a\": \"open"), StartsWith("a.json:1:"));
}

TEST(JsonReader, WhatFollowsANulIsNotPassedOver) {
  // Padding of a GLB's chunk is harmless.
  EXPECT_THAT(parse_error(std::string("{\"format\": \"stylet-test\", \"version\": 1}\0\0 \0", 44)), "no error");
  EXPECT_THAT(parse_error(std::string("{\"format\": \"stylet-test\", \"version\": 1}\0{}", 43)),
              StartsWith("a.json:1:40: a NUL"));
}

TEST(Printable, NothingActsOnATerminal) {
  EXPECT_EQ(one_line("Leber, Größe 3 \xE2\x89\xA4 4"), "Leber, Größe 3 \xE2\x89\xA4 4");
  EXPECT_EQ(one_line("a\x1B[2Jb\r\nc\x7F"), "a?[2Jb??c?");
  EXPECT_EQ(one_line("\xC2\x9B"
                     "31m\xC2\x85"),
            "?31m?")
      << "C1: CSI, next line";
  EXPECT_EQ(one_line("x\xE2\x80\xAEtxt.exe\xE2\x80\xA8\xE2\x81\xA6"), "x?txt.exe??") << "turned round, separated";
  EXPECT_EQ(one_line("caf\xE9 \xC0\x80 \xED\xA0\x80 \xF5"), "caf? ?? ??? ?") << "no UTF-8";
  EXPECT_EQ(printable("0123456789", 10), "0123456789");
  EXPECT_EQ(printable("01234567890", 10), "0123456...");
  EXPECT_EQ(printable("01234\xC3\xA4\xC3\xA4\xC3\xA4", 10), "01234\xC3\xA4...") << "no character is cut in two";
}

TEST(JsonReader, EveryMessageIsOneLine) {
  for (const std::string& text :
       {std::string("{\"a\n\": 1}"), std::string("{\"a\": \"x\ny\"}"), std::string("\x01\n\n")}) {
    EXPECT_THAT(parse_error(text), Not(HasSubstr("\n")));
  }
  const auto problems = problems_of(R"("bad\nkey": 1)", [](JsonObject&) {});
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0], Not(HasSubstr("\n")));
}

TEST(JsonReader, WrongFormatAndVersionAreNamed) {
  EXPECT_EQ(parse_error(R"({"version": 1})"),
            "a.json:/format: is missing; a file of this kind has \"format\": \"stylet-test\"");
  EXPECT_EQ(parse_error(R"({"format": "stylet-probe", "version": 1})"),
            "a.json:/format: is \"stylet-probe\"; a file of this kind has \"format\": \"stylet-test\"");
  EXPECT_EQ(parse_error(R"({"format": "stylet-test", "version": 7})"),
            "a.json:/version: is 7; this program reads version 1 of stylet-test");
  EXPECT_EQ(parse_error(R"({"format": "stylet-test", "version": "1"})"),
            "a.json:/version: is \"1\"; this program reads version 1 of stylet-test");
  EXPECT_THAT(parse_error("[1]"), StartsWith("a.json:/: is an array, expected an object"));
}

TEST(JsonReader, DeepNestingIsRefusedBeforeParsing) {
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  EXPECT_THAT(parse_error(deep), StartsWith("a.json:1:65: nested deeper than 64 levels"));
}

TEST(JsonReader, LargeTextIsRefused) {
  EXPECT_THAT(parse_error("{\"a\": 1}        ", {.bytes = 10, .depth = 4}),
              StartsWith("a.json: 16 bytes, the limit is 10"));
}

TEST(JsonReader, DuplicateKeyIsRefusedWithItsPlace) {
  EXPECT_EQ(parse_error("{\"a\": 1,\n \"b\": {\"a\": 2},\n \"a\": 3}"),
            "a.json:3:2: key \"a\" appears twice in one object; keep one");
  EXPECT_THAT(parse_error("{\"a\nb\": 1, \"a\nb\": 2}"), HasSubstr("key \"a?b\" appears twice")) << "one line";
  EXPECT_THAT(parse_error(R"({"a": ["b", "b"], "b": {"b": "b"}})"), HasSubstr("/format: is missing"))
      << "equal texts and equal keys at different depths are fine";
}

TEST(JsonReader, OverflowingNumberIsRefusedWithItsPlace) {
  EXPECT_THAT(parse_error("{\"a\": 1e999}"), StartsWith("a.json:1:7: number 1e999 does not fit a double"));
  EXPECT_THAT(parse_error("{\"a\": 1e-999}"), HasSubstr("/format: is missing")) << "underflow is zero";
}

TEST(JsonReader, UnknownKeySuggestsTheNearest) {
  EXPECT_THAT(problems_of(R"("lenght_mm": 3)", [](JsonObject& o) { o.number("length_mm", {}, 1); }),
              ElementsAre("a.json:/lenght_mm: is not a known key; did you mean \"length_mm\"?"));
  const auto far = problems_of(R"("zzz": 3)", [](JsonObject& o) { o.number("length_mm", {}, 1); });
  EXPECT_THAT(far, ElementsAre(StartsWith("a.json:/zzz: is not a known key; remove it (known: ")));
}

TEST(JsonReader, MissingKeyWrongTypeAndRangeAreNamedAtTheirPlace) {
  const auto problems = problems_of(
      R"("a": {"text": 5, "list": {}, "deep": [{"x": 11}], "whole": 2.5, "flag": 0, "v": [1, 2], "w": [1, "2", 3]})",
      [](JsonObject& o) {
        auto a = o.object("a");
        ASSERT_TRUE(a);
        a->number("needed", {0, 1});
        a->text("text");
        a->objects("list");
        for (auto& d : a->objects("deep")) d.number("x", {0, 10});
        a->integer("whole", 0, 9);
        a->boolean("flag", true);
        a->vector3("v", {});
        a->vector3("w", {});
        a->finish();
      });
  EXPECT_THAT(problems, ElementsAre("a.json:/a/needed: is missing; add it",                 //
                                    "a.json:/a/text: is a number, expected a text",         //
                                    "a.json:/a/list: is an object, expected an array",      //
                                    "a.json:/a/deep/0/x: is 11, accepted is 0 to 10",       //
                                    "a.json:/a/whole: is 2.5, expected a whole number",     //
                                    "a.json:/a/flag: is a number, expected true or false",  //
                                    "a.json:/a/v: is an array of 2, expected an array of 3 numbers",
                                    "a.json:/a/w/1: is a text, expected a number"));
}

TEST(JsonReader, BadValuesReadAsHarmlessOnes) {
  JsonFile file("a.json", R"({"x": 1e300, "q": [1, 1, 0, 0], "y": -5})");
  JsonObject root = file.root();
  EXPECT_EQ(root.number("x", {1, 2}), 1);
  EXPECT_EQ(root.number("y", {0, 9}, 4), 4);
  EXPECT_TRUE(root.quaternion("q", Eigen::Quaterniond::Identity()).isApprox(Eigen::Quaterniond::Identity()));
  EXPECT_EQ(file.problems().size(), 3u);
  EXPECT_THROW(file.throw_problems(), ContentError);
}

TEST(JsonReader, QuaternionsComeOutNormalised) {
  JsonFile file("a.json", R"({"q": [0.7073, 0, 0.7073, 0]})");
  const auto q = file.root().quaternion("q", Eigen::Quaterniond::Identity());
  EXPECT_NEAR(q.norm(), 1, 1e-15);
  EXPECT_THAT(file.problems(), IsEmpty());
}

TEST(JsonReader, PathsAreRelativeToTheFileThatNamesThem) {
  support::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "sub");
  folder.write("other.json", "{}");
  const auto path = folder.write("sub/a.json", R"({"f": "../other.json", "g": "gone.json"})");
  JsonFile file(path);
  JsonObject root = file.root();
  EXPECT_EQ(root.file("f"), folder.path() / "other.json");
  EXPECT_EQ(root.file("g"), std::filesystem::path());
  EXPECT_THAT(file.problems(), ElementsAre(HasSubstr("/g: there is no file gone.json; correct the path")));
}

TEST(JsonReader, RemembersTheKeysItWasAskedFor) {
  JsonFile file("a.json", R"({"list": [{"x": 1}, {}], "free": {"liver": {"e": 2}}})");
  JsonObject root = file.root();
  for (auto& item : root.objects("list")) item.number("x", {}, 0);
  for (auto& [name, row] : root.object("free")->entries()) row.number("e", {}, 0);
  EXPECT_THAT(file.accepted_keys().at(""), ElementsAre("free", "list"));
  EXPECT_THAT(file.accepted_keys().at("/list/*"), ElementsAre("x"));
  EXPECT_THAT(file.accepted_keys().at("/free/*"), ElementsAre("e"));
}

TEST(JsonReader, AliasIsReadAndTheKeyTakesPrecedence) {
  JsonFile file("a.json", R"({"youngsModulus": 5, "density": 7, "density_kg_per_m3": 8})");
  JsonObject root = file.root();
  root.alias("young_modulus_pa", "youngsModulus");
  root.alias("density_kg_per_m3", "density");
  EXPECT_EQ(root.number("young_modulus_pa", {}), 5);
  EXPECT_EQ(root.number("density_kg_per_m3", {}), 8);
  root.finish();
  EXPECT_THAT(file.problems(), IsEmpty());
}

}  // namespace
}  // namespace stylet::files
