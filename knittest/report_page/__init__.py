"""Self-contained HTML pages about runs: folders are loaded, sections made of blocks, blocks rendered by templates."""
