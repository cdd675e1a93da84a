#include "services/program/commandline/commandline.hpp"

#include <CLI/CLI.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace tandem::commandline {

template <class T>
Option Option::range(T least, T most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
template Option Option::range(int, int);
template Option Option::range(unsigned, unsigned);
template Option Option::range(std::size_t, std::size_t);
template Option Option::range(double, double);

Option Option::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Option Option::not_negative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Option Option::existing_file() {
  option_->check(CLI::ExistingFile);
  return *this;
}

Option Option::not_empty() {
  return check([](const std::string& value) {
    return value.empty() ? std::string("an empty value: leave the option out if there is none")
                         : std::string();
  });
}

Option Option::one_of(const std::vector<std::string>& names) {
  option_->check(CLI::IsMember(names));
  return *this;
}

Option Option::check(const std::function<std::string(const std::string&)>& refusal) {
  option_->check(refusal);
  return *this;
}

Option Option::required(bool is) {
  option_->required(is);
  return *this;
}

Option Option::needs(Option other) {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(Option other) {
  option_->excludes(other.option_);
  return *this;
}

Option Option::excludes(const std::vector<std::string>& others) {
  for (const std::string& other : others) option_->excludes(other);
  return *this;
}

Option Option::separated_by(char delimiter) {
  option_->delimiter(delimiter);
  return *this;
}

Option Option::one_value_each() {
  option_->allow_extra_args(false);
  return *this;
}

Option Option::type_name(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option Option::show_default() {
  option_->capture_default_str();
  return *this;
}

Option Option::show_default(const std::string& text) {
  option_->default_str(text);
  return *this;
}

template <class T>
Option Command::add_option(const std::string& name, T& variable, const std::string& help) {
  return Option(*app_->add_option(name, variable, help));
}
template Option Command::add_option(const std::string&, int&, const std::string&);
template Option Command::add_option(const std::string&, std::uint16_t&, const std::string&);
template Option Command::add_option(const std::string&, std::uint32_t&, const std::string&);
template Option Command::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option Command::add_option(const std::string&, double&, const std::string&);
template Option Command::add_option(const std::string&, std::string&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<std::size_t>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<std::uint32_t>&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<std::string>&, const std::string&);

template <class T>
Option Command::add_option_function(const std::string& name, const std::function<void(const T&)>& set,
                                    const std::string& help) {
  return Option(*app_->add_option_function<T>(name, set, help));
}
template <class T>
using Set = std::function<void(const T&)>;
template Option Command::add_option_function(const std::string&, const Set<std::string>&, const std::string&);
template Option Command::add_option_function(const std::string&, const Set<std::vector<std::string>>&,
                                             const std::string&);

Option Command::add_flag(const std::string& name, bool& variable, const std::string& help) {
  return Option(*app_->add_flag(name, variable, help));
}

Option Command::add_flag_function(const std::string& name, const std::function<void()>& set,
                                  const std::string& help) {
  return Option(*app_->add_flag_callback(name, set, help));
}

Option Command::option(const std::string& name) const { return Option(*app_->get_option(name)); }

Command Command::add_subcommand(const std::string& name, const std::string& help) {
  return Command(*app_->add_subcommand(name, help));
}

bool Command::has_subcommand(const std::string& name) const {
  return !app_->get_subcommands([&](const CLI::App* one) { return one->get_name() == name; }).empty();
}

void Command::require_subcommand() { app_->require_subcommand(1); }

void Command::footer(const std::string& text) { app_->footer(text); }

void Command::on_chosen(const std::function<void()>& callback) { app_->callback(callback); }

Program::Program(const std::string& description, const std::string& name)
    : Program(std::make_unique<CLI::App>(description, name)) {}

Program::Program(std::unique_ptr<CLI::App> app) : Command(*app), app_(std::move(app)) {}

Program::~Program() = default;

void Program::version(const std::string& text) { app_->set_version_flag("--version", text); }

std::optional<int> Program::parse(int argc, const char* const* argv, std::string* why) {
  try {
    app_->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (why != nullptr) *why = error.what();
    return app_->exit(error) == 0 ? 0 : 2;
  }
}

void refuse(const std::string& flag, const std::string& expected) {
  throw CLI::ValidationError(flag, expected);
}
void refuse_missing(const std::string& flag) { throw CLI::RequiredError(flag); }
void refuse_without(const std::string& flag, const std::string& other) {
  throw CLI::RequiresError(flag, other);
}

}  // namespace tandem::commandline
