"""`make proof`: missions over many surface models, each certificate held against a slow independent proof."""
