#include "workbench/evaluate/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/input_error.h"
#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel {
namespace {

using test::TempFolder;
using test::write_text;
using testing::HasSubstr;

constexpr const char* kHead = "[suite]\nname = \"s\"\ntolerance_m = 0.01\ntolerance_rad = 0.1\n";
constexpr const char* kIdentity = "truth = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";

std::string case_text(const std::string& more) {
  return std::string(kHead) +
         "[[case]]\nid = \"one\"\nkind = \"scene\"\nsource = \"m.ply\"\ntarget = \"r#7\"\n" + more;
}

std::string message_of(const std::string& text) {
  const TempFolder folder;
  const std::string file = write_text(folder / "suite.toml", text);
  try {
    static_cast<void>(load_suite(file));
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Suite, ReadsEveryFieldOfACase) {
  const TempFolder folder;
  const std::string file =
      write_text(folder / "suite.toml",
                 case_text(std::string(kIdentity) +
                           "camera = \"c.toml\"\ncolor = \"t.png\"\nsource_color = \"s.png\"\n"
                           "initial = [1,0,0,0.5, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"
                           "symmetry = \"box\"\nexpect = \"either\"\ngroup = \"g\"\n"));
  const Suite suite = load_suite(file);
  EXPECT_EQ(suite.name, "s");
  EXPECT_EQ(suite.tolerance_m, 0.01);
  EXPECT_EQ(suite.tolerance_rad, 0.1);
  ASSERT_EQ(suite.cases.size(), 1U);
  const SuiteCase& one = suite.cases[0];
  EXPECT_EQ(one.kind, CaseKind::Scene);
  EXPECT_EQ(one.source, (folder / "m.ply").string());
  EXPECT_EQ(one.target, (folder / "r#7").string());
  EXPECT_EQ(one.camera, (folder / "c.toml").string());
  EXPECT_EQ(one.color, (folder / "t.png").string());
  EXPECT_EQ(one.source_color, (folder / "s.png").string());
  ASSERT_TRUE(one.truth && one.initial && one.symmetry);
  EXPECT_EQ(one.initial->translation().x(), 0.5);
  EXPECT_EQ(*one.symmetry, Symmetry::Box);
  EXPECT_EQ(one.expect, Expect::Either);
  EXPECT_EQ(one.group, "g");
}

TEST(Suite, ExpectsWhatTheTruthImpliesUnlessTold) {
  const TempFolder folder;
  EXPECT_EQ(load_suite(write_text(folder / "a.toml", case_text(kIdentity))).cases[0].expect,
            Expect::Accept);
  EXPECT_EQ(load_suite(write_text(folder / "b.toml", case_text(""))).cases[0].expect,
            Expect::Reject);
}

TEST(Suite, TakesCasesOfManyViews) {
  const TempFolder folder;
  const std::string file =
      write_text(folder / "suite.toml",
                 std::string(kHead) +
                     "[[case]]\nid = \"m\"\nkind = \"many\"\n[[case.view]]\nsource = \"a.pcd\"\n"
                     "[[case.view]]\nsource = \"b.pcd\"\n");
  const SuiteCase one = load_suite(file).cases[0];
  EXPECT_EQ(one.kind, CaseKind::Many);
  ASSERT_EQ(one.views.size(), 2U);
  EXPECT_EQ(one.views[1].source, (folder / "b.pcd").string());
  EXPECT_EQ(one.expect, Expect::Reject);  // no truth
}

TEST(Suite, WantsTheTruthOfEveryViewOrOfNone) {
  const std::string truth = "truth = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  const auto many = [&](const std::string& first, const std::string& second) {
    return std::string(kHead) + "[[case]]\nid = \"m\"\nkind = \"many\"\n" +
           "[[case.view]]\nsource = \"a.pcd\"\n" + first + "[[case.view]]\nsource = \"b.pcd\"\n" +
           second;
  };
  const TempFolder folder;
  const auto load = [&](const std::string& text) {
    return load_suite(write_text(folder / "suite.toml", text));
  };
  EXPECT_EQ(load(many(truth, truth)).cases[0].expect, Expect::Accept);
  EXPECT_THROW(static_cast<void>(load(many(truth, ""))), InputError);
  EXPECT_THROW(static_cast<void>(load(std::string(kHead) + "[[case]]\nid = \"m\"\nkind = \"many\"\n"
                                                           "[[case.view]]\nsource = \"a.pcd\"\n")),
               InputError);
}

TEST(Suite, NamesFileLineKeyValueAndWhatIsAllowed) {
  const std::string text = message_of(case_text("kind2 = 1\n"));
  EXPECT_THAT(text, HasSubstr("suite.toml:10"));
  EXPECT_THAT(text, HasSubstr("kind2"));
  EXPECT_THAT(message_of(case_text("expect = \"maybe\"\n")), HasSubstr("\"either\""));
  EXPECT_THAT(message_of(case_text("symmetry = \"round\"\n")), HasSubstr("symmetry"));
  EXPECT_THAT(message_of(case_text("truth = [1, 2]\n")), HasSubstr("16 numbers"));
  EXPECT_THAT(message_of(case_text("truth = [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n")),
              HasSubstr("rigid"));
}

TEST(Suite, RefusesAnAcceptWithoutTruth) {
  EXPECT_THAT(message_of(case_text("expect = \"accept\"\n")), HasSubstr("needs a truth"));
}

TEST(Suite, RefusesAnIdTwice) {
  EXPECT_THAT(message_of(case_text("[[case]]\nid = \"one\"\nkind = \"pair\"\nsource = \"a.ply\"\n"
                                   "target = \"b.ply\"\n")),
              HasSubstr("unique"));
}

TEST(Suite, RefusesMissingParts) {
  EXPECT_THAT(message_of("[suite]\nname = \"s\"\n"), HasSubstr("case"));
  EXPECT_THAT(message_of(std::string(kHead) + "[[case]]\nid = \"x\"\nkind = \"pair\"\n"),
              HasSubstr("source"));
}

}  // namespace
}  // namespace grapnel
