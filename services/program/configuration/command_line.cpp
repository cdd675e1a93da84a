#include "services/program/configuration/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "services/program/configuration/file.hpp"
#include "services/program/metrics/probe.hpp"

namespace tandem::configuration {
namespace {

namespace pb = google::protobuf;

void add_flag(commandline::Command app, const Setting& setting, pb::Message& config) {
  using pb::FieldDescriptor;
  const FieldDescriptor* const field = setting.field;
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) {
    app.add_flag_function(
        setting.flag, [&config, field] { config.GetReflection()->SetBool(&config, field, true); },
        setting.help);
    return;
  }
  if (field->is_repeated() && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
    app.add_option_function<std::vector<std::string>>(
        setting.flag,
        [&config, field](const std::vector<std::string>& texts) {
          for (const std::string& text : texts) config.GetReflection()->AddString(&config, field, text);
        },
        setting.text());
    return;
  }
  const bool whole = field->cpp_type() == FieldDescriptor::CPPTYPE_UINT32 ||
                     field->cpp_type() == FieldDescriptor::CPPTYPE_UINT64;
  const bool number = whole || field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
  auto option = app.add_option_function<std::string>(
      setting.flag,
      [&config, &setting, whole](const std::string& text) {
        if (!set_text(*setting.field, text, config))
          commandline::refuse(setting.flag, whole ? "must be a whole number" : "must be a number");
      },
      setting.text());
  if (number) option.type_name(whole ? "UINT" : field->is_repeated() ? "FLOAT,..." : "FLOAT");
}

// fmt::print would throw where stderr takes no more.
void print_error(const std::string& text) { std::fputs(text.c_str(), stderr); }

Outcome ended(int exit_code) { return {.exit_code = exit_code}; }

Outcome said(const std::string& text) {
  return ended(std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0 ? 1 : 0);
}

}  // namespace

Outcome refuse(const std::string& program, const std::vector<Error>& errors) {
  const auto names_a_flag = [](const Error& error) { return error.message.starts_with("--"); };
  for (const Error& error : errors) print_error(fmt::format("{}: {}\n", program, error.message));
  if (std::ranges::any_of(errors, names_a_flag)) print_error("Run with --help for all flags.\n");
  return {.exit_code = 2, .why = errors.front().message};
}

Outcome read_command_line(commandline::Program& app, const std::string& program, const Form& form,
                          pb::Message& config, const Rules& rules, int argc, const char* const* argv) {
  bool check = false, shows = false;
  std::string question;
  Outcome outcome;
  for (const Setting& setting : form.settings()) {
    const auto own = rules.flags.find(setting.field->name());
    own == rules.flags.end() ? add_flag(app, setting, config) : own->second(app, setting);
  }
  app.add_option("--config", outcome.path,
                 "Configuration file (protobuf text); flags override it. --print-config shows its form");
  app.add_flag("--check-config", check,
               "Check the configuration as a start does, say all that is wrong, and exit");
  app.add_flag("--print-config", shows,
               "Print the configuration in force as a file, with what each field means and takes, and exit");
  app.add_option("--probe", question, metrics::kProbeHelp);
  if (const auto code = app.parse(argc, argv, &outcome.why)) {
    outcome.exit_code = *code;
    return outcome;
  }
  if (!question.empty()) return ended(metrics::probe(program.c_str(), question));
  if (check && rules.mistakes) {
    if (const auto mistakes = rules.mistakes(outcome.path, config); !mistakes.empty())
      return refuse(program, mistakes);
    return said("the configuration is good\n");
  }
  if (!outcome.path.empty()) {
    const std::unique_ptr<pb::Message> file(config.New());
    auto places = read_text(outcome.path).and_then([&](const std::string& text) {
      return parse(form, program, text, outcome.path, *file);
    });
    if (!places) return refuse(program, {places.error()});
    outcome.places = places_beside(config, std::move(*places));
    if (rules.displace) rules.displace(config, *file);
    merge(config, *file);
    config.GetReflection()->Swap(&config, file.get());
  }
  if (shows) return said(print(form, program, config));
  auto good = check_values(form, config);
  if (good && rules.check) good = rules.check(config);
  if (!good) return refuse(program, {placed(outcome.places, good.error())});
  if (check) return said("the configuration is good\n");
  return outcome;
}

}  // namespace tandem::configuration
