"""The subcommands of `whisker` that need the laboratory; as crunchbot.commands has them."""
