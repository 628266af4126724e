"""The questionnaire of the injury study (Quentin Ferre 2019): thirteen films, a page, tables."""
