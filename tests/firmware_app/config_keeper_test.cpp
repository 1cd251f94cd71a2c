#include "firmware_app/config_keeper.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/firmware_app/fakes.h"

namespace grapnel {
namespace {

constexpr const char* kConfig = R"(active_preset = 11
[camera]
driver = "replay"
)";

std::string config_with(int preset) {
  std::string text = kConfig;
  return text.replace(text.find("11"), 2, std::to_string(preset));
}

/// The config thread's rounds, turned by the test; the test is the registration thread, too.
class ConfigKeeperTest : public ::testing::Test {
 protected:
  ConfigKeeperTest() {
    file_ = folder_.write("grapnel.toml", kConfig);
    make();
  }
  void make() {
    exchange_ = std::make_unique<Exchange>();
    presets_ = std::make_unique<PresetSwitch>();
    keeper_ = std::make_unique<ConfigKeeper>(
        ConfigKeeper::Parts{exchange_.get(), &source_, presets_.get(),
                            [this](bool refused, Code, const std::string& line) {
                              (refused ? refusals_ : news_).push_back(line);
                            }},
        ConfigKeeper::Start{file_, overrides_}, std::span(memory_));
  }
  void start() {
    keeper_->start(folder_.path());
    take_over();
  }
  /// What the registration thread does between two jobs.
  void take_over() {
    if (ActivePreset* preset = presets_->take()) {
      active_ = preset->profile.preset.number;
      presets_->confirm(preset);
    }
  }
  const ConfigState& state() {
    exchange_->config.state.update();
    return exchange_->config.state.get();
  }
  void wish(ConfigAction action, std::uint16_t preset = 0) {
    exchange_->config.request.publish({++wishes_, action, preset});
    keeper_->step(false);
  }
  void edit(const std::string& text) {
    folder_.write("grapnel.toml", text);
    keeper_->step(true);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path file_;
  std::vector<std::string> overrides_;
  test::FakePresetSource source_;
  std::vector<std::byte> memory_ = std::vector<std::byte>(1 << 12);
  std::unique_ptr<Exchange> exchange_;
  std::unique_ptr<PresetSwitch> presets_;
  std::unique_ptr<ConfigKeeper> keeper_;
  std::vector<std::string> refusals_;
  std::vector<std::string> news_;
  std::uint32_t wishes_ = 0;
  int active_ = 0;
};

TEST_F(ConfigKeeperTest, StartsWithTheFilesPreset) {
  start();
  EXPECT_EQ(active_, 11);
  EXPECT_EQ(state().active.number, 11);
  EXPECT_EQ(state().active.rev, 1011);
  EXPECT_EQ(state().state, Code::ConfigLoaded);
  EXPECT_FALSE(state().reduced);
}

TEST_F(ConfigKeeperTest, AnEditedFileSwitchesAtTheJobsBoundary) {
  start();
  edit(config_with(12));
  EXPECT_TRUE(keeper_->switching());
  EXPECT_EQ(state().active.number, 11);  // the job that runs still has the old one
  keeper_->step(false);
  EXPECT_EQ(state().active.number, 11);
  take_over();
  keeper_->step(false);
  EXPECT_EQ(active_, 12);
  EXPECT_EQ(state().active.number, 12);
  EXPECT_EQ(state().reloads, 1U);
}

TEST_F(ConfigKeeperTest, BuildsTheNewPresetBesideTheOld) {
  start();
  EXPECT_EQ(source_.last_memory.data(), memory_.data());
  wish(ConfigAction::Select, 12);
  EXPECT_EQ(source_.last_memory.data(), memory_.data() + memory_.size() / 2);
  take_over();
  keeper_->step(false);
  wish(ConfigAction::Select, 11);
  EXPECT_EQ(source_.last_memory.data(), memory_.data());
}

TEST_F(ConfigKeeperTest, AnUnforeseenFailureIsARefusalLikeAnyOther) {
  start();
  wish(ConfigAction::Select, 15);
  EXPECT_EQ(state().answered, wishes_);
  EXPECT_EQ(state().answer, Code::FileUnreadable);
  edit(config_with(15));
  EXPECT_EQ(state().active.number, 11);
  EXPECT_EQ(state().refusals, 2U);
  EXPECT_EQ(refusals_.size(), 2U);
}

TEST_F(ConfigKeeperTest, ARefusedFileKeepsTheOldPresetAndSaysWhy) {
  start();
  edit("active_preset = 12\n[camera]\ndriver = \"replay\"\n[memory]\nbudget_mb = 0\n");
  EXPECT_FALSE(keeper_->switching());
  EXPECT_EQ(state().active.number, 11);
  EXPECT_EQ(state().state, Code::PresetInvalid);
  EXPECT_TRUE(state().reduced);
  EXPECT_EQ(state().refusals, 1U);
  ASSERT_EQ(refusals_.size(), 1U);
  EXPECT_EQ(refusals_[0],
            file_.string() + ":5: memory.budget_mb: 0 is out of range; 1 to 65536 MiB is allowed");
  edit(config_with(14));
  EXPECT_EQ(state().state, Code::OverMemoryBudget);
  std::filesystem::remove(file_);
  keeper_->step(true);
  EXPECT_EQ(state().state, Code::FileUnreadable);
  edit(config_with(12));
  take_over();
  keeper_->step(false);
  EXPECT_EQ(state().state, Code::ConfigLoaded);
  EXPECT_FALSE(state().reduced);
}

TEST_F(ConfigKeeperTest, AnswersTheWishOnceTheNewPresetIsInUse) {
  start();
  wish(ConfigAction::Select, 12);
  EXPECT_EQ(state().answered, 0U);
  take_over();
  keeper_->step(false);
  EXPECT_EQ(state().answered, 1U);
  EXPECT_EQ(state().answer, Code::ConfigLoaded);
  EXPECT_EQ(state().active.number, 12);
}

TEST_F(ConfigKeeperTest, AnswersARefusedWishWithItsCode) {
  start();
  wish(ConfigAction::Select, 77);
  EXPECT_EQ(state().answer, Code::PresetMissing);
  wish(ConfigAction::Select, 13);
  EXPECT_EQ(state().answer, Code::PresetInvalid);
  wish(ConfigAction::Check, 14);
  EXPECT_EQ(state().answer, Code::OverMemoryBudget);
  EXPECT_EQ(state().answered, 3U);
  EXPECT_EQ(state().active.number, 11);
  EXPECT_EQ(state().state, Code::ConfigLoaded);  // the file is still good
  EXPECT_FALSE(state().reduced);
}

TEST_F(ConfigKeeperTest, ChecksWithoutSwitching) {
  start();
  wish(ConfigAction::Check, 12);
  EXPECT_EQ(state().answer, Code::ConfigLoaded);
  EXPECT_EQ(state().active.number, 11);
  EXPECT_FALSE(keeper_->switching());
}

TEST_F(ConfigKeeperTest, ReloadsOnWish) {
  start();
  folder_.write("grapnel.toml", config_with(12));
  wish(ConfigAction::Reload);
  take_over();
  keeper_->step(false);
  EXPECT_EQ(state().active.number, 12);
  EXPECT_EQ(state().answer, Code::ConfigLoaded);
}

TEST_F(ConfigKeeperTest, GoesBackToWhatProvedItself) {
  start();
  wish(ConfigAction::LastGood);
  EXPECT_EQ(state().answer, Code::FileUnreadable);  // nothing has proved itself yet
  exchange_->job.finished = ConfigKeeper::kProvisionalJobs;
  keeper_->step(false);
  edit(config_with(12));
  take_over();
  keeper_->step(false);
  ASSERT_EQ(state().active.number, 12);
  wish(ConfigAction::LastGood);
  take_over();
  keeper_->step(false);
  EXPECT_EQ(state().active.number, 11);
  EXPECT_EQ(state().answer, Code::ConfigLoaded);
  EXPECT_EQ(state().state, Code::RolledBack);
  EXPECT_TRUE(state().reduced);
}

TEST_F(ConfigKeeperTest, StartsReducedOnTheLastGoodOneWhenTheFileIsBroken) {
  start();
  exchange_->job.finished = ConfigKeeper::kProvisionalJobs;
  keeper_->step(false);
  folder_.write("grapnel.toml", "active_preset = \n");
  make();
  start();
  EXPECT_EQ(active_, 11);
  EXPECT_EQ(state().state, Code::RolledBack);
  EXPECT_TRUE(state().reduced);
  EXPECT_EQ(refusals_.size(), 2U);
}

TEST_F(ConfigKeeperTest, DoesNotStartOnABrokenFileAlone) {
  folder_.write("grapnel.toml", "active_preset = 13\n[camera]\ndriver = \"replay\"\n");
  EXPECT_THROW(start(), ConfigProblem);
}

TEST_F(ConfigKeeperTest, SaysWhatNeedsARestart) {
  start();
  edit(config_with(12) + "folder = \"elsewhere\"\n");
  ASSERT_EQ(news_.size(), 1U);
  EXPECT_EQ(news_[0], "[camera] changed: takes effect at the next start");
}

TEST_F(ConfigKeeperTest, AnEditElsewhereLeavesThePresetThatThePlcSelected) {
  start();
  wish(ConfigAction::Select, 12);
  take_over();
  keeper_->step(false);
  ASSERT_EQ(active_, 12);
  edit(config_with(11) + "[roi]\nmax_occupied_share = 0.1\n");
  take_over();
  keeper_->step(false);
  EXPECT_EQ(active_, 12);
  EXPECT_EQ(keeper_->settings().roi.max_occupied_share, 0.1);
  wish(ConfigAction::Reload);
  take_over();
  keeper_->step(false);
  EXPECT_EQ(active_, 12);
}

TEST_F(ConfigKeeperTest, AFileThatNamesAnotherPresetOverrulesThePlc) {
  start();
  wish(ConfigAction::Select, 12);
  take_over();
  keeper_->step(false);
  edit(config_with(12));  // now the file's own
  take_over();
  keeper_->step(false);
  edit(config_with(11));
  take_over();
  keeper_->step(false);
  EXPECT_EQ(active_, 11);
}

TEST_F(ConfigKeeperTest, TheCommandLineOverridesTheFileAtEveryLoad) {
  overrides_ = {"active_preset=12"};
  make();
  start();
  EXPECT_EQ(active_, 12);
  edit(config_with(11));
  take_over();
  keeper_->step(false);
  EXPECT_EQ(active_, 12);
}

}  // namespace
}  // namespace grapnel
